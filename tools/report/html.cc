// SPDX-License-Identifier: Apache-2.0
#include "tools/report/html.h"

#include "tools/report/script.h"
#include "tools/report/svg.h"

namespace farpoint::tools::report {
namespace {

constexpr char kStyle[] = R"(
body{font:14px/1.45 "DejaVu Sans",Arial,Helvetica,sans-serif;color:#111;background:#fff;margin:24px auto;max-width:1120px;padding:0 16px}
h1{font-size:24px;margin:0 0 4px}h2{font-size:18px;margin:34px 0 4px;border-bottom:2px solid #333}
p{margin:4px 0 10px;max-width:900px}.row{display:flex;flex-wrap:wrap;gap:14px;align-items:flex-start;margin-bottom:14px}
svg{font:12px "DejaVu Sans",Arial,Helvetica,sans-serif}svg[role=img]{max-width:100%;height:auto}svg svg{overflow:hidden}
svg path{fill:none}.area polyline,.area line,.area path,.area rect{vector-effect:non-scaling-stroke}
.cursor{stroke:#555;stroke-width:1;stroke-dasharray:2 2}.chosen{fill:#0b3c78;fill-opacity:.12;stroke:#0b3c78}
.mark{font-weight:bold;paint-order:stroke;stroke:#fff;stroke-width:3px}[data-x]{touch-action:pan-y;user-select:none}
.tip{position:absolute;white-space:pre;pointer-events:none;background:#fffffff0;border:1px solid #555;padding:2px 6px;font-size:12px}
.title{font-weight:bold;font-size:13px}.grid{stroke:#ddd;stroke-width:1}.frame{fill:none;stroke:#333;stroke-width:1}
.scroll{overflow-x:auto}table{border-collapse:collapse;font-size:12px;margin:6px 0}
th,td{border:1px solid #bbb;padding:3px 4px;text-align:right}th{background:#eee;vertical-align:bottom}
th:first-child,td:first-child{text-align:left;white-space:nowrap}pre{font-size:12px;background:#f5f5f5;padding:8px;overflow-x:auto}
@media print{h2{break-after:avoid}svg,table{break-inside:avoid}}
)";

}  // namespace

std::string section(const std::string& title, const std::string& explanation, const std::string& content) {
  if (content.empty()) return {};
  return "<section><h2>" + escaped(title) + "</h2>\n<p>" + escaped(explanation) + "</p>\n" + content +
         "</section>\n";
}

std::string row_of(const std::vector<std::string>& pictures) {
  std::string out;
  for (const std::string& picture : pictures) out += picture;
  return out.empty() ? out : "<div class=\"row\">" + out + "</div>\n";
}

std::string table(const std::vector<std::vector<std::string>>& rows) {
  std::string out = "<div class=\"scroll\"><table>\n";
  for (std::size_t i = 0; i < rows.size(); ++i) {
    out += "<tr>";
    for (const std::string& cell : rows[i]) {
      const char* tag = i == 0 ? "th" : "td";
      out += std::string("<") + tag + ">" + escaped(cell) + "</" + tag + ">";
    }
    out += "</tr>\n";
  }
  return out + "</table></div>\n";
}

std::string page(const std::string& title, const std::string& body) {
  return "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>" + escaped(title) +
         "</title><style>" + kStyle + "</style></head><body>\n<h1>" + escaped(title) +
         "</h1>\n<p id=\"hint\"></p>\n" + body + "<script>" + page_script() + "</script>\n</body></html>\n";
}

}  // namespace farpoint::tools::report
