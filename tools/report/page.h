// An HTML page out of sections: one file, no network, the same bytes for the same sections.
#ifndef CAMGYRO_TOOLS_REPORT_PAGE_H_
#define CAMGYRO_TOOLS_REPORT_PAGE_H_

#include <string>
#include <vector>

namespace camgyro {

struct ReportSection {
  std::string id;     // anchor: letters, digits and '-'; unique on a page
  std::string title;  // plain text
  std::string html;   // made by the functions below and by charts.h
};

// The page: title, contents, sections in their order; style sheet, chart library and script are
// inside. Its content security policy forbids every request. `lead`: a line below the title.
std::string ReportPage(const std::string& title, const std::string& lead,
                       const std::vector<ReportSection>& sections);

// Text with the characters that HTML gives a meaning replaced.
std::string EscapeHtml(const std::string& text);

// <p> of plain text; `css_class` may be empty.
std::string Paragraph(const std::string& text, const std::string& css_class = "");

// <ul> of plain texts; empty without any.
std::string BulletList(const std::vector<std::string>& items);

// A cell with more than its text: `key` and `value` become data-key and data-value, where a program
// finds the number that the text rounds.
struct TableCell {
  std::string text;
  std::string key;
  double value = 0.0;
};
struct ReportTable {
  std::vector<std::string> header;
  std::vector<std::vector<TableCell>> rows;
};
// Cells that begin with a number are aligned to the right.
std::string TableHtml(const ReportTable& table);

}  // namespace camgyro

#endif  // CAMGYRO_TOOLS_REPORT_PAGE_H_
