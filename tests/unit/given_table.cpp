/// Displacements in the forms in which people and other programs write them, made here, and real ones of ../shared.
#include "segment/beads/given_table.h"

#include "pipeline/contract/errors.h"
#include "pipeline/contract/numbers.h"
#include "pipeline/files/csv_files.h"
#include "pipeline/files/foreign_table.h"
#include "pipeline/files/text.h"
#include "segment/beads/given_field.h"
#include "tests/support/bead_pair.h"
#include "tests/support/folders.h"
#include "tests/support/temporary_folder.h"

namespace mbtfm::beads {
namespace {

using Rows = std::vector<std::array<double, 4>>;

/// Places from 8 px on, 16 px apart, y down, and what a cell does there.
Rows vectors() {
  Rows rows;
  for (int j = 0; j < 8; ++j)
    for (int i = 0; i < 8; ++i)
      rows.push_back({8 + 16.0 * i, 8 + 16.0 * j, std::round(1e4 * std::sin(i + 0.3 * j)) / 1e4,
                      std::round(1e4 * std::cos(0.7 * i + j)) / 1e4});
  return rows;
}

/// A line for each row, cells between separators. @param number  as text
std::string lines_of(const Rows& rows, const std::string& separator,
                     const std::function<std::string(double)>& number = shortest, const std::string& end = "\n") {
  std::string text;
  for (const auto& row : rows) {
    for (std::size_t k = 0; k < row.size(); ++k) text += (k > 0 ? separator : "") + number(row[k]);
    text += end;
  }
  return text;
}

std::string with_comma(double value) {
  std::string text = shortest(value);
  const std::size_t point = text.find('.');
  return point == text.npos ? text : text.replace(point, 1, ",");
}

std::string utf16(const std::string& ascii, bool is_big_endian, bool has_mark) {
  std::string text = !has_mark ? "" : is_big_endian ? "\xFE\xFF" : "\xFF\xFE";
  for (const char c : ascii) text += is_big_endian ? std::string{'\0', c} : std::string{c, '\0'};
  return text;
}

GivenField read(const std::string& text, const TrackParameters& parameters = {}, const char* name = "field.csv") {
  const test::TemporaryFolder folder;
  files::write_text(folder / name, text);
  return read_given_field(folder / name, parameters);
}

TrackParameters in_pixels(LengthUnit unit = LengthUnit::automatic) {
  TrackParameters p;
  p.length_unit = unit;
  p.pixel_size_um = 0.1;
  return p;
}

/// To the last digit but what a change of the unit costs.
void expect_same(const GivenField& given, const Rows& rows, double um = 0.1, double first = 0.5) {
  ASSERT_EQ(given.field.size(), rows.size());
  for (std::size_t k = 0; k < rows.size(); ++k) {
    const Bead& bead = given.field[k];
    EXPECT_NEAR(bead.position_um.x, um * (rows[k][0] + first), 1e-9) << k;
    EXPECT_NEAR(bead.position_um.y, um * (rows[k][1] + first), 1e-9) << k;
    EXPECT_NEAR(bead.displacement_um.x, um * rows[k][2], 1e-12) << k;
    EXPECT_NEAR(bead.displacement_um.y, um * rows[k][3], 1e-12) << k;
  }
}

TEST(GivenTable, is_the_same_in_whatever_form_people_write_it) {
  const Rows rows = vectors();
  const std::string header = "x_px,y_px,u_px,v_px\n", lines = lines_of(rows, ",");
  const auto padded = [](double value) { return "  " + shortest(value) + " "; };
  const auto signed_and_d = [](double value) {
    char text[40];
    std::snprintf(text, sizeof text, "%+.17E", value);
    std::string number = text;
    return number.replace(number.find('E'), 1, "D");
  };
  const auto with_long_minus = [](double value) {
    return value < 0 ? "\xE2\x88\x92" + shortest(-value) : shortest(value);
  };
  const auto in_quotes = [](double value) { return '"' + with_comma(value) + '"'; };
  std::string numbered;
  for (std::size_t k = 0; k < rows.size(); ++k)
    numbered += '"' + std::to_string(k + 1) + "\" " + lines_of({rows[k]}, " ");
  const std::map<std::string, std::string> forms = {
      {"commas", header + lines},
      {"no last line break", header + lines.substr(0, lines.size() - 1)},
      {"CRLF", "x_px,y_px,u_px,v_px\r\n" + lines_of(rows, ",", shortest, "\r\n")},
      {"CR", "x_px,y_px,u_px,v_px\r" + lines_of(rows, ",", shortest, "\r")},
      {"a byte order mark", "\xEF\xBB\xBF" + header + lines},
      {"Unicode text of Excel",
       utf16("x_px\ty_px\tu_px\tv_px\r\n" + lines_of(rows, "\t", shortest, "\r\n"), false, true)},
      {"UTF-16 of the other end", utf16(header + lines, true, true)},
      {"UTF-16 without a mark", utf16(header + lines, false, false)},
      {"semicolons", "x_px;y_px;u_px;v_px\n" + lines_of(rows, ";")},
      {"sep=", "sep=;\nx_px;y_px;u_px;v_px\n" + lines_of(rows, ";", with_comma)},
      {"semicolons, decimal commas", "x_px;y_px;u_px;v_px\r\n" + lines_of(rows, ";", with_comma, "\r\n")},
      {"tabs, decimal commas", "x_px\ty_px\tu_px\tv_px\n" + lines_of(rows, "\t", with_comma)},
      {"blanks, decimal commas", "x_px y_px u_px v_px\n" + lines_of(rows, "   ", with_comma)},
      {"commas, numbers with commas in quotes", header + lines_of(rows, ",", in_quotes)},
      {"blanks after commas", "x_px, y_px, u_px, v_px\n" + lines_of(rows, ", ")},
      {"padded", "x_px \ty_px \tu_px \tv_px\n" + lines_of(rows, "\t", padded)},
      {"a comment as header", "# x_px y_px u_px v_px\n" + lines_of(rows, " ")},
      {"a percent sign before the header", "%x_px\ty_px\tu_px\tv_px\n" + lines_of(rows, "\t")},
      {"exponents of Fortran", header + lines_of(rows, ",", signed_and_d)},
      {"a long minus", header + lines_of(rows, ",", with_long_minus)},
      {"separators at the ends", header + lines_of(rows, ",", shortest, ",\n")},
      {"separators at all ends", "x_px,y_px,u_px,v_px,\n" + lines_of(rows, ",", shortest, ",\n")},
      {"empty rows", header + lines + "\n\n"},
      {"rows of nothing but separators", header + lines + ",,,\n,,,\n"},
      {"text above", "PIV export\nFRAME: 1, filenames: A & B, window: 32\n\n" + header + lines},
      {"units beneath", "x,y,ux,uy\n[px],[px],[px],[px]\n" + lines},
      {"names in quotes", "\"x [px]\",\"y [px]\",\"u [px/frame]\",\"v [px/frame]\"\n" + lines},
      {"names of R", "\"x..px.\",\"y..px.\",\"u..px.frame.\",\"v..px.frame.\"\n" + lines},
      {"names in words", "x in pixels,y in pixels,dx in pixels,dy in pixels\n" + lines},
      {"names by points", "X.px;Y.px;dX.px;dY.px\n" + lines_of(rows, ";")},
      {"columns and rows of a picture", "col_px,row_px,dc_px,dr_px\n" + lines},
      {"voxels", "x [voxel],y [voxel],u [voxel],v [voxel]\n" + lines},
      {"bars", "| x_px | y_px | u_px | v_px |\n|---|---|---|---|\n" +
                   lines_of(
                       rows, " ", [](double value) { return "| " + shortest(value); }, " |\n")},
      {"rows that R numbers", "\"x_px\" \"y_px\" \"u_px\" \"v_px\"\n" + numbered},
      {"other columns of one name", "i,x_px,i,y_px,i,u_px,v_px\n" + [&] {
         std::string text;
         for (const auto& r : rows)
           text += "1," + shortest(r[0]) + ",a," + shortest(r[1]) + ",," + shortest(r[2]) + "," + shortest(r[3]) + "\n";
         return text;
       }()}};
  for (const auto& [form, text] : forms) {
    SCOPED_TRACE(form);
    expect_same(read(text, in_pixels()), rows);
  }
  // whose unit nobody states
  for (const std::string above : {"", "Var1,Var2,Var3,Var4\n", "0,1,2,3\n", "x,y,u,v\n"}) {
    SCOPED_TRACE(above);
    expect_same(read(above + lines_of(rows, ",", padded), in_pixels(LengthUnit::px)), rows);
    EXPECT_THROW(read(above + lines_of(rows, ",", padded)), InputError);
  }
  TrackParameters by_number = in_pixels(LengthUnit::px);
  by_number.x_column = "2", by_number.y_column = "3", by_number.ux_column = "4", by_number.uy_column = "5";
  std::string longer;
  for (const auto& row : rows) longer += "7\t" + lines_of({row}, "\t", shortest, "\t3\n");
  expect_same(read(longer, by_number), rows);
  expect_same(read("Punkt\tLage x\tLage y\tx-Weg\ty-Weg\tG\xC3\xBCte\n" + longer, by_number), rows);
}

TEST(GivenTable, numbers_that_can_be_read_in_two_ways_are_refused) {
  const std::string header = "x_um;y_um;ux_um;uy_um\n";
  const std::map<std::string, std::string> refused = {
      {"thousands or decimals", header + "1,234;5,678;1,111;2,222\n9;9;9;9\n"},
      {"both marks", header + "1,5;2,5;0,25;0.5\n"},
      {"thousands and decimals", header + "1.234,5;2,5;0,25;0,5\n"},
      {"English thousands", header + "1,234.5;2.5;0.25;0.5\n"},
      {"thousands by blanks", header + "1 234,5;2,5;0,25;0,5\n2,5;2,5;2,5;2,5\n"},
      {"decimal commas between commas", "x_um,y_um,ux_um,uy_um\n0,85,0,85,0,01899,0,01661\n"},
      {"the same without a header", "0,85,0,85,0,01899,0,01661\n"},
      {"two columns that may be meant", "x [um],y [um],u [um],ux [um],v [um]\n1,2,3,4,5\n"},
      {"two columns of the name", "x_um,y_um,ux_um,ux_um,uy_um\n1,2,3,4,5\n"},
      {"a column less in the header", "x_um,y_um,ux_um,uy_um\n7,1,2,3,4\n7,1,2,3,4\n"},
      {"a first row that is none", "x_um,y_um,ux_um,uy_um\n1,2,3\n1,2,3,4\n"},
      {"a row cut off", "x_um,y_um,ux_um,uy_um\n1,2,3,4\n2,2,3\n"},
      {"a unit against the header", "x [m],y [m],u [m],v [m]\n1,2,3,4\n"},
      {"velocities without their time", "x [mm];y [mm];u [m/s];v [m/s]\n1;2;3;4\n"},
      {"two zones",
       "VARIABLES = \"x [px]\", \"y [px]\", \"u [px]\", \"v [px]\"\nZONE I=1\n1 2 3 4\nZONE I=1\n1 2 3 4\n"},
      {"a mask of most", "x_um,y_um,ux_um,uy_um,mask\n1,2,3,4,1\n2,2,3,4,1\n3,3,3,4,0\n"},
      {"places of both pictures",
       [] {
         std::string text = "x_um y_um ux_um uy_um\n";
         for (int k = 0; k < 40; ++k) text += lines_of({{1.0 * (k % 8), 1.0 * (k / 8), k % 8 + 0.1, k / 8 + 0.2}}, " ");
         return text;
       }()},
      {"lengths and angles",
       [] {
         std::string text = "x_um,y_um,ux_um,uy_um\n";
         for (int k = 0; k < 61; ++k) text += lines_of({{1.0 * (k % 8), 1.0 * (k / 8), 0.01 * k, 6.0 * k - 180}}, ",");
         return text;
       }()},
      {"several times",
       [] {
         std::string text = "t,x_um,y_um,ux_um,uy_um\n";
         for (int k = 0; k < 40; ++k) text += "1," + lines_of({{1.0 * (k % 20), 1, 0.01 * k, 0.02}}, ",");
         return text;
       }()},
      {"a sum of the columns", "i,x_um,y_um,ux_um,uy_um\n1,1,2,3,4\n2,2,2,3,4\nMean,1.5,2,3,4\n"},
      {"a date of Excel", "x_um;y_um;ux_um;uy_um\n1;2;3;4\n2;2;3;01.05.2023\n"},
      {"letters", "x_um,y_um,ux_um,uy_um\n1,2,3,4\n1,2,3,o.4\n"},
      {"nothing", ""},
      {"a page", "<html>\n<body>1 2 3 4</body>\n"}};
  for (const auto& [what, text] : refused) {
    TrackParameters p;
    if (what == "a unit against the header") p = in_pixels(LengthUnit::px);
    const auto error = test::caught<InputError>([&] { read(text, p); });
    EXPECT_TRUE(error) << what;
    EXPECT_TRUE(has_words(error.value_or(InputError("", "", "")).where, "field.csv")) << what;
  }
  for (const char* workbook : {"PK\x03\x04\x14", "\xD0\xCF\x11\xE0\xA1"}) {
    const auto error = test::caught<InputError>([&] { read(workbook); });
    EXPECT_TRUE(error && has_words(error->hint, "as CSV")) << "a workbook is no text";
  }
  const auto hint = [](const std::string& text) { return test::thrown<InputError>([&] { read(text); }).hint; };
  EXPECT_TRUE(has_words(hint("track_id,t,y,x\n1,0,2,3\n1,1,2,4\n"), "how far it lies")) << "not columns 3 and 4";
  EXPECT_TRUE(has_words(hint("x_um,y_um,magnitude,direction\n1,2,3,4\n"), "cos"));
  for (const std::string_view packed :
       {"\x1F\x8B\x08", "MATLAB 5.0 MAT-file", "MATLAB 7.3 MAT-file", "\x89HDF\r\n", "<?xml version=\"1.0\"?>"})
    EXPECT_TRUE(test::caught<InputError>([&] { read(std::string(packed)); })->hint.size() > 0);
  // one comma that is no thousands' decides for all
  EXPECT_EQ(read(header + "1,234;5,678;0,111;2,222\n").field[0].position_um, (Vec2{1.234, 5.678}));
}

TEST(GivenTable, a_missing_number_is_flagged_and_a_row_without_a_place_counted) {
  std::string text = "x_um,y_um,ux_um,uy_um\n";
  for (int k = 0; k < 20; ++k)
    text += std::to_string(k) + "," + std::to_string(k % 5) + ",0.1,0." + std::to_string(k) + "\n";
  const std::vector<std::string> missing = {"NaN", "nan", "", "#N/A", "#NV", "#DIV/0!", "NA", "Inf", "-1.#IND", "null"};
  for (const std::string& word : missing)
    text += "3.5,3." + std::to_string(&word - missing.data()) + "," + word + ",0.2\n";
  const GivenField given = read(text + "NaN,NaN,NaN,NaN\n#N/A,#N/A,0.1,0.2\n");
  ASSERT_EQ(given.field.size(), 20 + missing.size());
  EXPECT_EQ(given.n_left_out, 2);
  for (std::size_t k = 20; k < given.field.size(); ++k)
    EXPECT_EQ(given.field[k].flag, "not a number") << missing[k - 20];
}

TEST(GivenTable, a_missing_number_in_the_first_rows_is_no_header) {
  const Rows rows = vectors();
  for (const std::string word :
       {"NaN", "", "--", "-", ".", "?", "*", "********", "n.d.", "n. def.", "masked", "missing", "NaN(0)", "-nan(ind)",
        "-NaN(SNaN)", "1.#QNAN0", "-1.#IND00", "\xE2\x88\x9E", "#NV"}) {
    SCOPED_TRACE(word);
    std::string text = "x_px;y_px;u_px;v_px\n";
    for (std::size_t k = 0; k < rows.size(); ++k)
      text += k < 3 ? shortest(rows[k][0]) + ";8;" + word + ";" + word + "\n" : lines_of({rows[k]}, ";");
    const GivenField given = read(text, in_pixels());
    ASSERT_EQ(given.field.size(), rows.size());
    for (std::size_t k = 0; k < 5; ++k) EXPECT_EQ(given.field[k].flag == "not a number", k < 3) << k;
    EXPECT_NEAR(given.field[5].displacement_um.x, 0.1 * rows[5][2], 1e-12);
  }
}

/// y counted upwards from the lower border of a picture of 128 px, rows in the order of the picture.
Rows upwards(Rows rows) {
  for (auto& row : rows) row[1] = 128 - row[1], row[3] = -row[3];
  return rows;
}

struct Form {
  TableForm form;
  std::string text;
  const char* name = "field.csv";
  double seconds = 0;
};

std::vector<Form> forms_of_programs(const Rows& rows) {
  const auto scaled = [](Rows result, double place, double first, double displacement) {
    for (auto& r : result)
      r = {place * (r[0] + first), place * (r[1] + first), displacement * r[2], displacement * r[3]};
    return result;
  };
  const auto with_more = [&](const Rows& all, const std::string& separator, const std::string& more) {
    return lines_of(all, separator, shortest, separator + more + "\n");
  };
  std::string spots =
      "LABEL,ID,TRACK_ID,QUALITY,POSITION_X,POSITION_Y,POSITION_Z,POSITION_T,FRAME\n"
      "Label,Spot ID,Track ID,Quality,X,Y,Z,T,Frame\nLabel,Spot ID,Track ID,Quality,X,Y,Z,T,Frame\n"
      ",,,(quality),(pixel),(pixel),(pixel),(sec),\n";
  for (std::size_t k = 0; k < rows.size(); ++k)
    for (const int frame : {0, 1}) {
      const std::string id = std::to_string(100 * frame + static_cast<int>(k));
      spots += "ID" + id + "," + id + "," + std::to_string(k + 10) + ",9.5," +
               shortest(rows[k][0] + frame * rows[k][2]) + "," + shortest(rows[k][1] + frame * rows[k][3]) + ",0,0," +
               std::to_string(frame) + "\n";
    }
  const std::string by_pivlab =
      "PIVlab, ASCII chart output - 01-Jan-2026\r\nFRAME: 1, filenames: A.tif & B.tif, conversion factor xy (px -> "
      "m): ";
  return {
      {TableForm::openpiv, "# x\ty\tu\tv\tflags\tmask\n" + with_more(upwards(rows), "\t", "0.0\t0.0")},
      {TableForm::pivlab, by_pivlab +
                              "1, conversion factor uv (px/frame -> m/s): 1\r\nx [px],y [px],u [px/frame],v "
                              "[px/frame],Vector type [-]\r\n" +
                              with_more(scaled(rows, 1, 1, 1), ",", "1")},
      {TableForm::pivlab,
       by_pivlab +
           "1e-07, conversion factor uv (px/frame -> m/s): 4e-07\r\nx [m],y [m],u [m/s],v [m/s],Vector type [-]\r\n" +
           with_more(scaled(rows, 1e-7, 1, 4e-7), ",", "1")},
      {TableForm::imagej_piv, lines_of(rows, " ")},
      {TableForm::imagej_piv, with_more(rows, " ", "1 0 0.9 0 0 0 0 0 0 0 0 0")},
      {TableForm::davis,
       "#DaVis 8.1.2 2D-vector 16 8 8 \"\" \"mm\" \"\" \"mm\" \"velocity\" \"m/s\"\r\n" +
           lines_of(scaled(upwards(rows), 1e-4, 0.5, 2e-4), "\t", with_comma, "\r\n"),
       "B00001.txt", 5e-4},
      {TableForm::tecplot,
       "TITLE = \"B00001\"\nVARIABLES = \"x [mm]\", \"y [mm]\",\n\"Vx [mm]\", \"Vy [mm]\", \"isValid\"\nZONE T=\"1\", "
       "I=8, J=8, F=POINT\n" +
           with_more(scaled(rows, 1e-4, 0.5, 1e-4), " ", "1"),
       "B00001.dat"},
      {TableForm::trackmate, spots}};
}

TEST(GivenTable, of_each_program_is_found_by_its_head_and_read_as_it_means_it) {
  const Rows rows = vectors();
  for (Form& form : forms_of_programs(rows)) {
    SCOPED_TRACE(name_of(form.form));
    TrackParameters p = in_pixels();
    if (form.seconds > 0) p.seconds_between = form.seconds;
    if (form.form == TableForm::trackmate) {
      EXPECT_TRUE(has_words(test::thrown<InputError>([&] { read(form.text, p); }).hint, "relaxed_time = 1"));
      p.relaxed_plane.time = 1, p.stressed_plane.time = 2;
    }
    Rows expected = rows;
    const GivenField given = read(form.text, p, form.name);
    EXPECT_EQ(given.form, form.form);
    EXPECT_FALSE(given.how.empty());
    if (form.form == TableForm::trackmate) std::ranges::sort(expected);
    GivenField sorted = given;
    if (form.form == TableForm::trackmate)
      std::ranges::sort(sorted.field, {}, [](const Bead& b) { return std::pair(b.position_um.x, b.position_um.y); });
    expect_same(sorted, expected);
    p.table = form.form;  // and if it is said
    EXPECT_EQ(read(form.text, p, form.name).field.size(), rows.size());
  }
}

TEST(GivenTable, its_units_may_differ_by_column_and_be_velocities) {
  const Rows rows = vectors();
  Rows in_mm = rows;
  for (auto& row : in_mm) row[0] *= 1e-4, row[1] *= 1e-4;
  TrackParameters timed = in_pixels();
  expect_same(read("x [mm],y [mm],u [px],v [px]\n" + lines_of(in_mm, ","), timed), rows, 0.1, 0);
  expect_same(read("x [mm],y [mm],u,v\n" + lines_of(in_mm, ","), in_pixels(LengthUnit::px)), rows, 0.1, 0);
  Rows faster = rows;
  for (auto& row : faster) row[2] *= 4, row[3] *= 4;
  timed.seconds_between = 0.25;
  expect_same(read("x [px],y [px],u [px/s],v [px/s]\n" + lines_of(faster, ","), timed), rows);
  expect_same(read("# x y u v mask\n" + lines_of(faster, " ", shortest, " 0\n"), timed), rows);
  for (const auto& [unit, seconds] : std::map<std::string, double>{
           {"px/min", 15}, {"px/h", 900}, {"px s^-1", 0.25}, {"px s\xE2\x81\xBB\xC2\xB9", 0.25}, {"px min-1", 15}}) {
    SCOPED_TRACE(unit);
    timed.seconds_between = seconds;
    expect_same(read("x [px],y [px],u [" + unit + "],v [" + unit + "]\n" + lines_of(faster, ","), timed), rows);
  }
  EXPECT_THROW(read("x [px],y [px],u [px],v [px]\n" + lines_of(rows, ","), timed), InputError);
  EXPECT_EQ(read("x [px],y [px],u [px],v [px],sigma_um\n" + lines_of(rows, ",", shortest, ",0.02\n"), in_pixels())
                .field[0]
                .sigma_um,
            0.02);
}

TEST(GivenTable, rows_that_their_program_masked_or_filled_in_are_flagged) {
  const Rows rows = vectors();
  const auto flag_of_third = [&](const std::string& header, const std::string& good, const std::string& bad,
                                 const std::string& separator) {
    std::string text = header;
    for (std::size_t k = 0; k < rows.size(); ++k)
      text += lines_of({rows[k]}, separator, shortest, separator + (k == 2 ? bad : good) + "\n");
    const GivenField given = read(text, in_pixels());
    for (std::size_t k = 0; k < rows.size(); ++k) EXPECT_TRUE(k == 2 || given.field[k].flag != "masked") << header;
    return given.field[2].flag;
  };
  EXPECT_EQ(flag_of_third("x y u v flags mask\n", "0 0", "0 1", " "), "masked");
  EXPECT_EQ(flag_of_third("x [px],y [px],u [px],v [px],Vector type [-]\n", "1", "2", ","), "filled in");
  EXPECT_EQ(flag_of_third("x [px],y [px],u [px],v [px],Vector type [-]\n", "1", "0", ","), "masked");
  EXPECT_EQ(flag_of_third("VARIABLES = \"X px\", \"Y px\", \"U px\", \"V px\", \"CHC\"\nZONE I=8\n", "1", "-1", ", "),
            "masked");
  EXPECT_EQ(flag_of_third("x_px;y_px;u_px;v_px;isValid\n", "1", "0", ";"), "masked");
  for (const auto& [good, bad] : {std::pair("yes", "no"), {"True", "False"}, {"valid", "invalid"}})
    EXPECT_EQ(flag_of_third("x_px;y_px;u_px;v_px;valid\n", good, bad, ";"), "masked") << good;
  EXPECT_EQ(flag_of_third("x_px;y_px;u_px;v_px;outlier\n", "0", "1", ";"), "masked");
  EXPECT_EQ(flag_of_third("x_px;y_px;u_px;v_px;typevector\n", "1", "0", ";"), "masked");
  EXPECT_EQ(flag_of_third("x y ux1 uy1 mag1 ang1 p1 ux2 uy2 mag2 ang2 p2 ux0 uy0 mag0 flag\n",
                          "1 0 0.9 0 0 0 0 0 0 0 0 0", "1 0 0.9 0 0 0 0 0 0 0 0 999", " "),
            "filled in");
  EXPECT_EQ(flag_of_third("", "1 0 0.9 0 0 0 0 0 0 0 0 0", "1 0 0.9 0 0 0 0 0 0 0 0 999", " "), "filled in");
}

TEST(GivenTable, y_that_falls_from_row_to_row_points_up_and_the_user_is_asked) {
  const test::TemporaryFolder folder;
  const Rows rows = vectors();
  const std::string text = "x [px];y [px];u [px];v [px]\n" + lines_of(upwards(rows), ";");
  const GivenField given = read(text, in_pixels());
  expect_same(given, rows);
  ASSERT_EQ(given.findings.size(), 1u);
  EXPECT_TRUE(has_words(given.findings[0].text, "track.y_axis = down"));
  TrackParameters said = in_pixels();
  said.y_axis = VerticalAxis::down;
  EXPECT_TRUE(read(text, said).findings.empty());
  expect_same(read(text, said), upwards(rows));
  said.y_axis = VerticalAxis::up;
  expect_same(read(text, said), rows);
  // windows that end above the lower border
  const Rows upper(rows.begin(), rows.begin() + 48);
  expect_same(read("x [px];y [px];u [px];v [px]\n" + lines_of(upwards(upper), ";"), said), upper);
  // from an origin in the picture's middle
  Rows about_middle = upwards(rows);
  for (auto& row : about_middle) row[0] -= 64, row[1] -= 64;
  const GivenField moved = read("x [px];y [px];u [px];v [px]\n" + lines_of(about_middle, ";"), in_pixels());
  expect_same(moved, rows, 0.1, 0);
  EXPECT_EQ(moved.findings.size(), 2u);
  // of single beads about the middle of the picture
  Rows beads = rows;
  for (std::size_t k = 0; k < beads.size(); ++k) beads[k][1] += 0.01 * static_cast<double>(k);
  const auto of_beads = "x [px];y [px];u [px];v [px]\n" + lines_of(upwards(beads), ";");
  files::write_text(folder / "b.csv", of_beads);
  expect_same(read_given_field(folder / "b.csv", said, images::ImageField{128, 129, {}}), beads);
  // our own names mean our own axes
  EXPECT_TRUE(read("x_um,y_um,ux_um,uy_um\n" + lines_of(upwards(rows), ",")).findings.empty());
}

TEST(GivenTable, of_pytfm_is_two_arrays_over_the_picture) {
  const test::TemporaryFolder folder;
  const auto write = [&](const char* name, const std::vector<float>& values) {
    std::string header = "{'descr': '<f4', 'fortran_order': False, 'shape': (2, 3), }";
    header.resize(117, ' ');
    std::string bytes = std::string("\x93NUMPY\x01\x00", 8) + '\x76' + '\0' + header + '\n';
    bytes.append(reinterpret_cast<const char*>(values.data()), 4 * values.size());
    files::write_text(folder / name, bytes);
  };
  write("01u.npy", {0, 1, 2, 3, 4, 0.5});
  write("01v.npy", {0, -1, -2, -3, -4, NAN});
  EXPECT_THROW(read_given_field(folder / "01u.npy", in_pixels()), InputError) << "of which spacing?";
  const GivenField given = read_given_field(folder / "01u.npy", in_pixels(), images::ImageField{30, 20, {}});
  EXPECT_EQ(given.form, TableForm::pytfm);
  ASSERT_EQ(given.field.size(), 6u);
  EXPECT_NEAR(given.field[1].position_um.x, 1.5, 1e-12);
  EXPECT_NEAR(given.field[3].position_um.y, 1.5, 1e-12);
  EXPECT_NEAR(given.field[4].displacement_um.y, -0.4, 1e-12);
  EXPECT_EQ(given.field[5].flag, "not a number");
  EXPECT_THROW(read_given_field(folder / "01v.npy", in_pixels(), images::ImageField{30, 20, {}}), InputError);
  files::write_text(folder / "02u.npy", "no array");
  EXPECT_THROW(read_given_field(folder / "02u.npy", in_pixels(), images::ImageField{30, 20, {}}), InputError);
}

TEST(GivenTable, is_what_the_other_stages_point_to_where_theirs_is_masked) {
  const test::TemporaryFolder folder;
  std::string text = "x_um,y_um,ux_um,uy_um\n";
  for (int k = 0; k < 20; ++k)
    text += std::to_string(k) + "," + std::to_string(k % 5) + "," + (k == 7 ? "-9999" : "0.1") + ",0\n";
  files::write_text(folder / "d.csv", text);
  const auto error = test::thrown<InputError>([&] { files::read_displacement(folder / "d.csv"); });
  EXPECT_TRUE(has_words(error.hint, "mbtfm-track --displacement"));
  EXPECT_EQ(read_given_field(folder / "d.csv", {}).field[7].flag, "masked");
}

/// A cell on a lattice of 40 x 40 places, 1.6 um apart, with noise.
DisplacementField cell(double noise_um, std::uint64_t seed = 5) {
  const auto peaks = test::ring_of_adhesions(64, 0.3);
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal(0, noise_um);
  DisplacementField field;
  for (int j = 0; j < 40; ++j)
    for (int i = 0; i < 40; ++i) {
      const Vec2 place{1.6 * i + 0.8, 1.6 * j + 0.8}, u = test::displacement(peaks, place);
      const double x = noise_um > 0 ? normal(random) : 0, y = noise_um > 0 ? normal(random) : 0;
      field.push_back({place, u + Vec2{x, y}, 0, ""});
    }
  return field;
}

std::string table_of(const DisplacementField& field, int digits) {
  std::string text = "x_um,y_um,ux_um,uy_um\n";
  char line[1024];
  for (const Bead& b : field) {
    std::snprintf(line, sizeof line, "%.2f,%.2f,%.*f,%.*f\n", b.position_um.x, b.position_um.y, digits,
                  b.displacement_um.x, digits, b.displacement_um.y);
    text += line;
  }
  return text;
}

std::size_t n_masked(const GivenField& given) {
  return static_cast<std::size_t>(std::ranges::count(given.field, "masked", &Bead::flag));
}

TEST(GivenTable, what_many_rows_share_to_the_last_digit_is_a_mask_and_no_noise) {
  constexpr double kNoise_um = 0.004;
  for (const Vec2 written : {Vec2{-9999, -9999}, {0, 0}, {-1, -1}, {1e10, 1e10}, {0.1, 0.1}, {1e300, -1e300}}) {
    for (const bool is_scattered : {false, true}) {
      SCOPED_TRACE(shortest(written.x) + (is_scattered ? " here and there" : " in one part"));
      DisplacementField field = cell(kNoise_um);
      std::set<std::size_t> masked;
      for (std::size_t k = 0; k < field.size(); ++k)
        if (is_scattered ? k % 13 == 4 : field[k].position_um.x + field[k].position_um.y < 45) masked.insert(k);
      for (const std::size_t k : masked) field[k].displacement_um = written;
      const GivenField given = read(table_of(field, 5));
      EXPECT_EQ(n_masked(given), masked.size());
      for (const std::size_t k : masked) EXPECT_EQ(given.field[k].flag, "masked");
      ASSERT_EQ(given.findings.size(), 1u);
      EXPECT_EQ(given.findings[0].id, "input-not-used");
      EXPECT_NEAR(given.findings[0].number.value_or(0),
                  static_cast<double>(masked.size()) / static_cast<double>(field.size()), 1e-12);
      EXPECT_NEAR(given.field[0].sigma_um, kNoise_um, 0.2 * kNoise_um);
    }
  }
}

TEST(GivenTable, a_sound_table_shares_values_and_masks_none) {
  // digits of a table in um; noise from none to many of its steps
  for (const int digits : {2, 3, 4, 5, 12})
    for (const double noise_um : {0.0, 0.001, 0.003, 0.01, 0.03})
      for (const std::uint64_t seed : {5, 6, 7})
        EXPECT_EQ(n_masked(read(table_of(cell(noise_um, seed), digits))), 0u)
            << digits << " " << noise_um << " " << seed;
  // one adhesion alone, as of finite elements: at rest far away, held at the border
  for (const int digits : {2, 3, 4, 17}) {
    DisplacementField field = cell(0);
    for (Bead& bead : field) {
      const Vec2 d = bead.position_um - Vec2{32, 32};
      const double to_border = std::max(0.0, 1 - std::max(std::abs(d.x), std::abs(d.y)) / 31.2);
      bead.displacement_um = (to_border * 0.5 * std::exp(-norm(d) / 4)) * Vec2{1, 0.3};
    }
    EXPECT_EQ(n_masked(read(table_of(field, digits))), 0u) << digits;
  }
  // correlation to whole pixels; all alike
  DisplacementField whole = cell(0.003), alike = cell(0);
  for (Bead& bead : whole)
    bead.displacement_um = {0.1 * std::round(bead.displacement_um.x / 0.1),
                            0.1 * std::round(bead.displacement_um.y / 0.1)};
  EXPECT_EQ(n_masked(read(table_of(whole, 5))), 0u);
  for (Bead& bead : alike) bead.displacement_um = {0, 0};
  EXPECT_EQ(n_masked(read(table_of(alike, 5))), 0u);
}

TEST(GivenTable, as_users_brought_it_is_read) {
  const fs::path tables = test::source_folder() / "../shared/faults/users/tables";
  if (!fs::exists(tables)) GTEST_SKIP() << "the shared data are absent: " << tables;
  const DisplacementField plain = read_given_field(tables / "blank_last_lines.csv", in_pixels()).field;
  ASSERT_EQ(plain.size(), 484u);
  EXPECT_EQ(plain[0].displacement_um, (Vec2{0.01899, 0.01661}));
  for (const char* name :
       {"nan_places.csv", "openpiv_padded.txt", "semicolon_decimal_comma.csv", "space_after_comma.csv",
        "three_header_lines.txt", "unicode_text.csv", "masked_zero.csv", "masked_minus9999.csv"}) {
    SCOPED_TRACE(name);
    const GivenField given = read_given_field(tables / name, in_pixels());
    EXPECT_EQ(given.field.size(), plain.size());
    EXPECT_EQ(given.n_left_out, std::string(name) == "nan_places.csv" ? 1 : 0);
    std::map<std::pair<double, double>, const Bead*> at;
    const auto place = [](Vec2 p) { return std::pair(std::round(1e3 * p.x), std::round(1e3 * p.y)); };
    for (const Bead& bead : plain) at[place(bead.position_um)] = &bead;
    int n = 0;
    for (const Bead& bead : given.field) {
      ASSERT_TRUE(at.contains(place(bead.position_um))) << bead.position_um.x << " " << bead.position_um.y;
      if (bead.flag == "masked") continue;
      ++n;
      EXPECT_LT(norm(bead.displacement_um - at[place(bead.position_um)]->displacement_um), 1e-5);
    }
    EXPECT_EQ(n_masked(given) > 0, std::string(name).starts_with("masked"));
    EXPECT_GT(n, 300);
  }
}

TEST(GivenTable, of_other_peoples_real_work_is_read) {
  const fs::path data = test::source_folder() / "../shared/data";
  if (!fs::exists(data)) GTEST_SKIP() << "the shared data are absent: " << data;
  const struct {
    const char* file;
    TableForm form;
    std::size_t n;
  } cases[] = {{"beads/mdck_pdms_bism/reference/PIV1.txt", TableForm::imagej_piv, 608},
               {"beads/mdck_pdms_bism/reference/PIV2.txt", TableForm::imagej_piv, 608},
               {"displacement/easytfm_synthetic/converted_frame1.csv", TableForm::plain, 2601},
               {"beads/axon/published_piv.csv", TableForm::plain, 0},
               {"displacement/pytfm_colonies/WT03_u.npy", TableForm::pytfm, 0},
               {"displacement/pytfm_colonies/KO04_u.npy", TableForm::pytfm, 0}};
  for (const auto& c : cases) {
    const GivenField given = read_given_field(data / c.file, in_pixels(), images::ImageField{1024, 1024, {}});
    EXPECT_EQ(given.form, c.form) << c.file;
    EXPECT_TRUE(c.n == 0 || given.field.size() == c.n) << c.file << ": " << given.field.size();
    EXPECT_EQ(n_masked(given), 0u) << c.file;
    EXPECT_TRUE(given.findings.empty()) << c.file;
  }
}

}  // namespace
}  // namespace mbtfm::beads
