#include "tools/report/page.h"

#include <algorithm>
#include <cctype>

#include "core/format.h"
#include "tools/report/assets.h"

namespace camgyro {
namespace {

bool LooksNumeric(const std::string& text) {
  return !text.empty() &&
         (std::isdigit(static_cast<unsigned char>(text[0])) || text[0] == '-' || text[0] == '+');
}

}  // namespace

std::string EscapeHtml(const std::string& text) {
  std::string escaped;
  for (const char c : text) {
    switch (c) {
      case '&':
        escaped += "&amp;";
        break;
      case '<':
        escaped += "&lt;";
        break;
      case '>':
        escaped += "&gt;";
        break;
      case '"':
        escaped += "&quot;";
        break;
      default:
        escaped += c;
    }
  }
  return escaped;
}

std::string Paragraph(const std::string& text, const std::string& css_class) {
  return (css_class.empty() ? "<p>" : "<p class=\"" + css_class + "\">") + EscapeHtml(text) +
         "</p>\n";
}

std::string BulletList(const std::vector<std::string>& items) {
  if (items.empty()) return "";
  std::string html = "<ul>\n";
  for (const std::string& item : items) html += "<li>" + EscapeHtml(item) + "</li>\n";
  return html + "</ul>\n";
}

std::string TableHtml(const ReportTable& table) {
  std::string html = "<div class=\"wide\"><table>\n<thead><tr>";
  const auto numeric = [&](size_t column) {
    return std::any_of(table.rows.begin(), table.rows.end(), [&](const auto& row) {
      return column < row.size() && LooksNumeric(row[column].text);
    });
  };
  for (size_t i = 0; i < table.header.size(); ++i) {
    html += (numeric(i) ? "<th class=\"number\">" : "<th>") + EscapeHtml(table.header[i]) + "</th>";
  }
  html += "</tr></thead>\n<tbody>\n";
  for (const auto& row : table.rows) {
    html += "<tr>";
    for (const TableCell& cell : row) {
      html += LooksNumeric(cell.text) ? "<td class=\"number\"" : "<td";
      if (!cell.key.empty()) {
        html += Format(" data-key=\"%s\" data-value=\"%.10g\"", EscapeHtml(cell.key).c_str(),
                       cell.value);
      }
      html += ">" + EscapeHtml(cell.text) + "</td>";
    }
    html += "</tr>\n";
  }
  return html + "</tbody>\n</table></div>\n";
}

std::string ReportPage(const std::string& title, const std::string& lead,
                       const std::vector<ReportSection>& sections) {
  std::string html =
      "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
      "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; "
      "style-src 'unsafe-inline'; script-src 'unsafe-inline'; img-src data:\">\n"
      "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n"
      "<meta name=\"color-scheme\" content=\"light dark\">\n<title>" +
      EscapeHtml(title) + "</title>\n<style>\n" + assets::kDygraphCss + assets::kReportCss +
      "</style>\n</head>\n<body>\n<header>\n<h1>" + EscapeHtml(title) + "</h1>\n" +
      Paragraph(lead, "lead") + "<nav>";
  for (const ReportSection& section : sections) {
    html += "<a href=\"#" + section.id + "\">" + EscapeHtml(section.title) + "</a> ";
  }
  html += "</nav>\n</header>\n<main>\n";
  for (const ReportSection& section : sections) {
    html += "<section id=\"" + section.id + "\">\n<h2>" + EscapeHtml(section.title) + "</h2>\n" +
            section.html + "</section>\n";
  }
  return html + "</main>\n<script>\n" + assets::kDygraphJs + "</script>\n<script>\n" +
         assets::kSynchronizerJs + "</script>\n<script>\n" + assets::kReportJs +
         "</script>\n</body>\n</html>\n";
}

}  // namespace camgyro
