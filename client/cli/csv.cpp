#include "client/cli/csv.hpp"

#include <algorithm>
#include <set>
#include <utility>

#include "client/cli/failure.hpp"
#include "client/cli/text.hpp"

namespace colony::client {
namespace {

constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";

class Reader {
 public:
  Reader(std::string_view text, const std::string& name, char delimiter)
      : text_(text), name_(name), delimiter_(delimiter) {}

  bool at_end() const { return at_ == text_.size(); }

  CsvRow read_row() {
    CsvRow row;
    row.line = line_;
    for (;;) {
      row.fields.push_back(peek() == '"' ? read_quoted() : read_bare());
      if (at_end()) return row;
      if (text_[at_] == delimiter_) {
        ++at_;
        continue;
      }
      end_line();
      return row;
    }
  }

  [[noreturn]] void fail(std::size_t line, const std::string& message) const {
    throw Failure(ExitCode::kUsage, printable(name_) + ":" + std::to_string(line) + ": " + message);
  }

 private:
  char peek() const { return at_end() ? '\n' : text_[at_]; }

  bool at_line_end() const {
    return text_[at_] == '\n' || (text_[at_] == '\r' && (at_ + 1 == text_.size() || text_[at_ + 1] == '\n'));
  }

  void end_line() {
    if (text_[at_] == '\r') ++at_;
    if (!at_end()) ++at_;
    ++line_;
  }

  std::string read_bare() {
    const std::size_t start = at_;
    for (; !at_end() && text_[at_] != delimiter_ && !at_line_end(); ++at_) {
      if (text_[at_] == '"') fail(line_, "a quote inside a field that does not begin with one");
      if (text_[at_] == '\0') fail(line_, "a NUL byte; this is not a text table");
    }
    return std::string(text_.substr(start, at_ - start));
  }

  std::string read_quoted() {
    const std::size_t opened = line_;
    std::string field;
    for (++at_;; ++at_) {
      if (at_end()) fail(opened, "a quoted field is never closed");
      const char c = text_[at_];
      if (c == '\0') fail(line_, "a NUL byte; this is not a text table");
      if (c == '\n') ++line_;
      if (c != '"') {
        field += c;
      } else if (at_ + 1 < text_.size() && text_[at_ + 1] == '"') {
        field += '"';
        ++at_;
      } else {
        ++at_;
        break;
      }
    }
    if (!at_end() && text_[at_] != delimiter_ && !at_line_end()) fail(line_, "text after a closing quote");
    return field;
  }

  std::string_view text_;
  const std::string& name_;
  char delimiter_;
  std::size_t at_ = 0;
  std::size_t line_ = 1;
};

}  // namespace

char guess_delimiter(std::string_view text) {
  constexpr std::string_view kCandidates = ",;\t";
  std::size_t counts[3] = {};
  bool quoted = false;
  for (const char c : text) {
    if (c == '"') quoted = !quoted;
    if (quoted) continue;
    if (c == '\n' || c == '\r') break;
    const std::size_t which = kCandidates.find(c);
    if (which != std::string_view::npos) ++counts[which];
  }
  return kCandidates[static_cast<std::size_t>(std::max_element(counts, counts + 3) - counts)];
}

CsvTable parse_csv(std::string_view text, const std::string& name, char delimiter) {
  if (text.substr(0, kByteOrderMark.size()) == kByteOrderMark) text.remove_prefix(kByteOrderMark.size());
  CsvTable table;
  table.name = name;
  Reader reader(text, name, delimiter);
  while (!reader.at_end()) {
    CsvRow row = reader.read_row();
    if (row.fields.size() == 1 && row.fields[0].empty()) continue;
    if (table.header.empty()) {
      table.header = std::move(row.fields);
      std::set<std::string> seen;
      for (const std::string& column : table.header) {
        if (!seen.insert(column).second) reader.fail(row.line, "two columns are called '" + printable(column) + "'");
      }
      continue;
    }
    if (row.fields.size() != table.header.size()) {
      reader.fail(row.line, std::to_string(row.fields.size()) + " fields where the header has " +
                                std::to_string(table.header.size()));
    }
    table.rows.push_back(std::move(row));
  }
  if (table.header.empty()) reader.fail(1, "the table is empty");
  return table;
}

}  // namespace colony::client
