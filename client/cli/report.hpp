// report: one self-contained HTML page about a job or an analysed picture: no scripts, and nothing is loaded from anywhere.
// Promise: every text from the server is escaped; pictures are data URIs, curves inline SVG.
// Threads: pure.
#pragma once

#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "client/cli/text.hpp"

namespace colony::client {

struct ReportInput {
  Json job;       // GET /v1/jobs/{id}
  Json series;    // its items
  Json analysis;  // GET /v1/jobs/{id}/analysis, or null where there is nothing to measure; it says of which moment it is, the pictures are of the same
  std::vector<std::pair<std::string, std::string>> pictures;  // caption, PNG bytes
};

std::string report_html(const ReportInput& input);

/// A picture that was analysed, as POST /v1/analyses answers.
struct AnalysisPageInput {
  Json analysis;
  std::vector<std::pair<std::string, std::string>> pictures;
};
std::string analysis_html(const AnalysisPageInput& input);

std::string base64(std::string_view bytes);
std::string html_text(std::string_view text);

struct Curve {
  std::string name, colour;
  std::vector<std::pair<double, double>> points;  // of a logarithmic plot: above 0
};
/// An SVG of curves over common axes from 0 (linear) or from the least decade (logarithmic), with a legend.
std::string curves_svg(const std::vector<Curve>& curves, const std::string& x_title, const std::string& y_title,
                       bool is_logarithmic);

}  // namespace colony::client
