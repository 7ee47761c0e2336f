// Open a cell folder of mbtfm in Fiji: the actin and adhesion images, and what was found as selections in the ROI Manager.
// Correct fibres there; then Select All and More >> Save as fibres.zip in the cell folder, and run mbtfm again. Names as
// "ventral 3", "dorsal 1", "arc 2", "edge 4" or "unclassified 5" fix a fibre's type.
//
// Install: copy this file into Fiji's folder "macros", then Plugins > Macros > Run. In a script: argument = the cell folder.
folder = getArgument();
if (folder == "") folder = getDirectory("Choose a cell folder of mbtfm");
if (!endsWith(folder, File.separator)) folder = folder + File.separator;
if (!File.exists(folder + "run.json"))
  exit("No run.json in " + folder + ":\nchoose a cell folder that mbtfm run has been through");

record = File.openAsString(folder + "run.json");
keys = newArray("actin", "adhesion");
opened = 0;
for (i = 0; i < keys.length; i++) {
  file = imageOf(record, keys[i]);
  if (file != "" && File.exists(folder + file)) {
    open(folder + file);
    rename(keys[i]);
    run("Enhance Contrast", "saturated=0.35");
    opened++;
  }
}
if (opened == 0) open(folder + "1_segment" + File.separator + "images.jpg");

roiManager("reset");
if (File.exists(folder + "1_segment" + File.separator + "RoiSet.zip")) {
  roiManager("open", folder + "1_segment" + File.separator + "RoiSet.zip");
  roiManager("show all with labels");
}
if (File.exists(folder + "4_fit" + File.separator + "tensions.csv"))
  Table.open(folder + "4_fit" + File.separator + "tensions.csv");

// The file of a key in the object "images" of run.json, which has one key a line.
function imageOf(text, key) {
  from = indexOf(text, "\"images\": {");
  if (from < 0) return "";
  part = substring(text, from, indexOf(text, "}", from));
  at = indexOf(part, "\"" + key + "\": \"");
  if (at < 0) return "";
  begin = at + lengthOf(key) + 5;
  return substring(part, begin, indexOf(part, "\"", begin));
}
