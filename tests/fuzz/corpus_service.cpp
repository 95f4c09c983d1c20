// corpus_service: writes the first inputs of the service's fuzzers into FOLDER/gate, /spec, /event and /sse, and the words of a job spec into
//                 FOLDER/spec.dict. Why not committed: names, presets and ranges come from the tables that the codec reads, so they cannot fall behind.
// Usage: corpus_service FOLDER
#include <filesystem>
#include <fstream>
#include <iostream>
#include <set>
#include <string>
#include <string_view>

#include "engine/model/params.hpp"
#include "server/api/codec_model.hpp"
#include "server/api/codec_spec.hpp"

namespace {

using namespace colony;
using namespace colony::server::api;

void write(const std::filesystem::path& folder, std::string_view bytes) {
  static int number = 0;
  std::filesystem::create_directories(folder);
  std::ofstream(folder / std::to_string(number++), std::ios::binary) << bytes;
}

void write_requests(const std::filesystem::path& folder) {
  const std::string host = "Host: localhost\r\n";
  const std::string json = "Content-Type: application/json\r\n";
  for (const std::string& request : std::initializer_list<std::string>{
           "GET / HTTP/1.1\r\n" + host + "\r\n",
           "GET /v1/jobs?state=queued&label=a%3Ab&limit=5 HTTP/1.1\r\n" + host + "Accept: application/json\r\n\r\n",
           "GET http://localhost:8080/v1/jobs/counts HTTP/1.1\r\n" + host + "\r\n",
           "HEAD /healthz HTTP/1.0\r\n" + host + "Connection: keep-alive\r\n\r\n",
           "POST /v1/jobs HTTP/1.1\r\n" + host + json +
               "Content-Length: 25\r\n\r\n{\"until\": {\"cells\": 100}} GET / HTTP/1.1\r\n\r\n",
           "POST /v1/jobs HTTP/1.1\r\n" + host + json +
               "Expect: 100-continue\r\nTransfer-Encoding: chunked\r\n\r\n5;a=b\r\nhello\r\n0\r\nX: y\r\n\r\nrest",
           "POST /v1/analyses HTTP/1.1\r\n" + host +
               "Content-Type: image/png\r\nTransfer-Encoding: chunked\r\n\r\n0\r\n\r\n",
           "DELETE /v1/jobs/a HTTP/1.1\r\n" + host +
               "Origin: http://localhost:8080\r\nX-Request-Id: abc-1\r\nIf-Match: \"1.2\"\r\n\r\n",
           "OPTIONS /v1/jobs HTTP/1.1\r\n" + host + "Origin: https://example.org\r\nAuthorization: Bearer x\r\n\r\n",
           "PATCH /a/%C3%A4%20b HTTP/1.1\r\nHost: [::1]:8080\r\nContent-Length: 2\r\n\r\n{}"}) {
    write(folder, "\x07" + request);
  }
}

void write_specs(const std::filesystem::path& folder) {
  write(folder, R"({"until": {"cells": 100}})");
  write(
      folder,
      R"({"name": "AHH-1 at 37 \u00b0C", "labels": {"plate": "7"}, "seed": 1, "preset": "paper", "until": {"time_h": 240, "cells": 2000},
    "model": {"cycle": {"mean_h": 12, "sd_h": 2}, "division": {"generation_limit": null}}})");
  write(folder, R"({"until": {"time_h": 1e1}, "model": {"founders": {"positions_um": [[0, 0], [4e2, -0.0]]}}})");
  for (const auto name : preset_names()) {
    JobSpec spec;
    spec.preset = name;
    spec.run.params = *preset(name);
    spec.run.until.cells = 500;
    write(folder, to_text(encode_spec(spec)));
  }
}

void write_dictionary(const std::filesystem::path& file) {
  std::set<std::string> words = {"name",  "labels", "seed", "preset", "until",   "time_h",
                                 "cells", "model",  "null", "true",   "\\u0000", "1e308"};
  for (const auto name : preset_names()) words.insert(std::string(name));
  for (const ParamInfo& info : param_table()) {
    const std::string path(info.path);
    const std::size_t dot = path.find('.');
    words.insert(path.substr(0, dot));
    if (dot != std::string::npos) words.insert(path.substr(dot + 1));
  }
  std::ofstream out(file);
  for (const std::string& word : words) {
    out << '"';
    for (const char c : word) out << (c == '\\' ? "\\\\" : std::string(1, c));
    out << "\"\n";
  }
}

void write_streams(const std::filesystem::path& folder) {
  for (const char* stream : {"retry: 2000\n\nevent: founded\nid: 1\ndata: {\"seq\":1}\n\n",
                             "id: 18446744073709551615\r\ndata: a\r\ndata: b\r\n\r\n",
                             "\xEF\xBB\xBF: keep-alive\n\nid\n\nevent: progress\ndata: {}\n\nid: 7\n\nevent: "
                             "end\ndata: {\"state\":\"succeeded\"}\n\n",
                             "data: x\rid: 5\r\r", "18446744073709551616", "007", "9223372036854775807"}) {
    write(folder, std::string("\x03") + stream);
  }
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) {
    std::cerr << "usage: corpus_service FOLDER\n";
    return 2;
  }
  const std::filesystem::path top = argv[1];
  write_requests(top / "gate");
  write_specs(top / "spec");
  write_dictionary(top / "spec.dict");
  write_streams(top / "sse");
  // Choices and numbers: a kind is the last byte that is read first, so a few long runs of one byte reach each.
  for (int kind = 0; kind < 8; ++kind) {
    for (const char filler : {'\0', '\x3f', '\x40', '\xbf'})
      write(top / "event",
            std::string(900, filler) + std::string(1, static_cast<char>(kind)) + std::string(16, filler));
  }
  return 0;
}
