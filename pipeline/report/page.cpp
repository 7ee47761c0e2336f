#include "pipeline/report/page.h"

#include "pipeline/report/svg.h"

namespace mbtfm::report {
namespace {

constexpr const char* kStyle = R"css(
:root{color-scheme:light}
*{box-sizing:border-box}
body{margin:0;background:#f4f5f7;color:#1a1d21;font:16px/1.5 system-ui,-apple-system,"Segoe UI","DejaVu Sans",sans-serif}
main{max-width:1340px;margin:0 auto;padding:20px 16px 60px}
h1{font-size:1.6rem;line-height:1.25;margin:.2em 0;overflow-wrap:anywhere}
h2{font-size:1.2rem;margin:0 0 .6em}
h3{font-size:1rem;margin:0 0 .4em}
section{background:#fff;border:1px solid #dfe2e6;border-radius:8px;padding:16px;margin:14px 0}
p{margin:.4em 0}
.sub,figcaption{color:#555;font-size:.9rem}
ul.findings{list-style:none;margin:0;padding:0}
ul.findings li{padding:.45em .7em;margin:.4em 0;border-left:5px solid #8a929b;background:#f6f7f8}
ul.findings li.good{border-color:#00805c}
ul.findings li.caution{border-color:#d89000;background:#fff8e8}
ul.findings li.bad{border-color:#c4320a;background:#fdf0ec}
ul.findings b{margin-right:.3em}
.grid{display:grid;grid-template-columns:repeat(auto-fill,minmax(min(100%,460px),1fr));gap:18px}
figure{margin:0}
figure>svg,figure>img{display:block;width:100%;height:auto;max-width:680px}
svg{font:14px system-ui,"DejaVu Sans",sans-serif}
svg .frame{fill:#fff;stroke:#444}
svg .tick{stroke:#444;fill:none}
svg .grid{stroke:#e3e5e8;fill:none}
svg path{fill:none}
.what{font-size:1.05rem}
.scroll{overflow-x:auto;max-width:100%;margin:.7em 0}
table{border-collapse:collapse;font-size:.86rem;width:auto}
th,td{padding:.28em .55em;border-bottom:1px solid #e6e8eb;text-align:left;vertical-align:top}
th{cursor:pointer;white-space:nowrap;background:#f6f7f8}
th:hover{background:#e9ecef}
td.n,th.n{text-align:right;font-variant-numeric:tabular-nums;white-space:nowrap}
details{margin:.6em 0}
summary{cursor:pointer;font-weight:600}
.keep{white-space:nowrap}
.type{display:inline-block;width:.75em;height:.75em;border-radius:50%;margin-right:.4em}
@media (max-width:600px){
main{padding:12px 8px 40px}section{padding:12px 10px}
svg{font-size:17px}
th,th.n{white-space:normal}th,td{padding:.28em .3em}table{font-size:.8rem}
}
@media print{body{background:#fff}section{break-inside:avoid;border:0}}
)css";

// A click on a column's title sorts; a second click reverses.
constexpr const char* kScript = R"js(
document.querySelectorAll('th').forEach(function(th){th.addEventListener('click',function(){
var table=th.closest('table'),body=table.tBodies[0],i=th.cellIndex,isNumber=th.classList.contains('n');
var down=th.dataset.down!=='1';th.dataset.down=down?'1':'0';
var key=function(row){var t=row.cells[i].textContent.replace('\u2212','-');var v=parseFloat(t);
return isNumber?(isNaN(v)?-Infinity:v):t};
Array.from(body.rows).sort(function(a,b){var x=key(a),y=key(b);return (x<y?-1:x>y?1:0)*(down===isNumber?-1:1)})
.forEach(function(row){body.appendChild(row)})})});
)js";

}  // namespace

std::string html_of(const Table& table) {
  std::string html = "<div class=\"scroll\"><table><thead><tr>";
  for (const Table::Column& column : table.columns) {
    html += std::string("<th") + (column.is_number ? " class=\"n\"" : "") + " title=\"click to sort\">" +
            html_escaped(column.title) + "</th>";
  }
  html += "</tr></thead><tbody>\n";
  for (const auto& row : table.rows) {
    html += "<tr>";
    for (std::size_t i = 0; i < row.size(); ++i) {
      html += std::string(table.columns[i].is_number ? "<td class=\"n\">" : "<td>") + row[i] + "</td>";
    }
    html += "</tr>\n";
  }
  return html + "</tbody></table></div>\n";
}

std::string html_of_pairs(const std::vector<std::pair<std::string, std::string>>& pairs) {
  std::string html = "<div class=\"scroll\"><table><tbody>\n";
  for (const auto& [name, value] : pairs) {
    html += "<tr><td>" + html_escaped(name) + "</td><td>" + html_escaped(value) + "</td></tr>\n";
  }
  return html + "</tbody></table></div>\n";
}

std::string section(const std::string& title, const std::string& content) {
  return "<section><h2>" + html_escaped(title) + "</h2>\n" + content + "</section>\n";
}

std::string folded(const std::string& title, const std::string& content) {
  return "<details><summary>" + html_escaped(title) + "</summary>\n" + content + "</details>\n";
}

std::string figure(const std::string& title, const std::string& picture, const std::string& caption) {
  return "<figure><h3>" + html_escaped(title) + "</h3>\n" + picture + "<figcaption>" + html_escaped(caption) +
         "</figcaption></figure>\n";
}

std::string page(const std::string& title, const std::string& body) {
  return "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">"
         "<meta name=\"viewport\" content=\"width=device-width,initial-scale=1\">"
         "<link rel=\"icon\" href=\"data:,\"><title>" +
         html_escaped(title) + "</title><style>" + kStyle + "</style></head>\n<body><main>\n" + body +
         "</main><script>" + kScript + "</script></body></html>\n";
}

}  // namespace mbtfm::report
