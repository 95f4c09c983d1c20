// csv: reads a table as RFC 4180 writes it: quoted fields, doubled quotes, line ends inside quotes, CRLF or LF, an
// optional byte order mark. Values stay text: what is a number is the reader's question. Errors:  Failure kUsage with
// `name:line: message`: an open quote, text after a closing quote, a quote inside a bare field, a row
//          whose field count differs from the header's, an empty table, equal column names, a NUL byte.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace colony::client {

struct CsvRow {
  std::size_t line = 0;  // where the row starts in the file, from 1
  std::vector<std::string> fields;
};

struct CsvTable {
  std::string name;  // of the file, for messages
  std::vector<std::string> header;
  std::vector<CsvRow> rows;  // each with as many fields as the header
};

/// The most frequent of comma, semicolon and tab outside quotes in the first line; comma if there is none.
char guess_delimiter(std::string_view text);

/// Blank lines are skipped.
CsvTable parse_csv(std::string_view text, const std::string& name, char delimiter);

}  // namespace colony::client
