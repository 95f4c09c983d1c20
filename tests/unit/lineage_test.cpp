// Lineages: a small history whose trees are written down by hand, and a reader of Newick that shares nothing with the writer.
#include <cstdlib>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/api/lineage.hpp"
#include "tests/support/scale.hpp"
#include "tests/unit/api_support.hpp"

namespace colony::server::testing {
namespace {

using api::Json;
using api::Lineage;
using ::testing::ElementsAre;

Event founded(std::uint32_t id, double time_h) {
  Event event;
  Founded body;
  body.cell.id = CellId{id};
  event.time_h = time_h;
  event.body = body;
  return event;
}

Event divided(std::uint32_t parent, std::uint32_t daughter, double time_h) {
  Event event;
  Divided body;
  body.cells[0].id = CellId{parent};
  body.cells[1].id = CellId{daughter};
  event.time_h = time_h;
  event.body = body;
  return event;
}

Lineage lineage_of(const std::vector<Event>& events) {
  Lineage lineage;
  for (const Event& event : events) lineage.add(event);
  return lineage;
}

std::string newick(Lineage lineage, double time_h) {
  http::Response response;
  response.stream = std::make_unique<api::NewickSource>(std::move(lineage), time_h);
  return body_of(response);
}

/// A tree as read: nodes in the order in which their text ends; children by index.
struct Node {
  std::string name;
  double length = 0.0;
  std::vector<std::size_t> children;
};

/// Reads trees; the roots' indices. No recursion: depth is what is tested.
std::vector<std::size_t> parse_newick(const std::string& text, std::vector<Node>& nodes) {
  std::vector<std::size_t> roots;
  std::vector<std::vector<std::size_t>> open;  // children so far of every node that is not closed
  std::vector<std::size_t> closed;             // of the parenthesis that was just closed
  bool after_close = false;
  for (std::size_t at = 0; at < text.size();) {
    const char c = text[at];
    if (c == '(') {
      open.emplace_back();
      ++at;
    } else if (c == ')') {
      CHECK(!open.empty());
      closed = std::move(open.back());
      open.pop_back();
      after_close = true;
      ++at;
    } else if (c == ',' || c == '\n') {
      ++at;
    } else if (c == ';') {
      CHECK(open.empty());
      roots.push_back(nodes.size() - 1);
      ++at;
    } else {
      const std::size_t colon = text.find(':', at);
      CHECK(colon != std::string::npos);
      Node node;
      node.name = text.substr(at, colon - at);
      char* end = nullptr;
      node.length = std::strtod(text.c_str() + colon + 1, &end);
      if (std::exchange(after_close, false)) node.children = std::exchange(closed, {});
      if (!open.empty()) open.back().push_back(nodes.size());
      nodes.push_back(std::move(node));
      at = static_cast<std::size_t>(end - text.c_str());
    }
  }
  return roots;
}

/// Each leaf's name and its distance from the root.
std::map<std::string, double> leaf_depths(const std::vector<Node>& nodes, std::size_t root) {
  std::map<std::string, double> depths;
  std::vector<std::pair<std::size_t, double>> open = {{root, 0.0}};
  while (!open.empty()) {
    const auto [index, above] = open.back();
    open.pop_back();
    const double depth = above + nodes[index].length;
    if (nodes[index].children.empty()) depths.emplace(nodes[index].name, depth);
    for (const std::size_t child : nodes[index].children) open.emplace_back(child, depth);
  }
  return depths;
}

TEST(Lineage, OfASmallHistoryIsAsWrittenByHand) {
  const auto lineage = lineage_of(
      {founded(1, 0), founded(2, 0), divided(1, 3, 10), divided(3, 4, 15), divided(1, 5, 20)});
  EXPECT_EQ(newick(lineage, 25.5), "((1:5.5,5:5.5):10,(3:10.5,4:10.5):5):10;\n2:25.5;\n");
  EXPECT_EQ(newick(lineage_of({founded(1, 0)}), 0), "1:0;\n");
  EXPECT_EQ(newick(Lineage(), 3), "");
  // Never an exponent: not every reader knows it.
  EXPECT_EQ(newick(lineage_of({founded(1, 0)}), 1e-7), "1:0.0000001;\n");
}

TEST(Lineage, IsReadBackWithEveryLeafAtTheSameTime) {
  ApiFixture fixture;
  auto response = fixture.get(kJob + "/lineage", {{"Accept", "text/x-newick"}});
  EXPECT_EQ(header(response, "Content-Type"), "text/x-newick");
  std::vector<Node> nodes;
  const auto roots = parse_newick(body_of(response), nodes);
  ASSERT_EQ(roots.size(), 1u);
  const double end_h = fixture.jobs.history.back().time_h;
  const auto depths = leaf_depths(nodes, roots[0]);
  EXPECT_EQ(depths.size(), 6u);
  for (const auto& [name, depth] : depths) EXPECT_NEAR(depth, end_h, 1e-9 * end_h) << name;

  // The table has the same births.
  auto table = fixture.get(kJob + "/lineage");
  const Json json = json_of(table);
  ASSERT_EQ(json["items"].size(), 6u);
  EXPECT_EQ(json["digest"], fixture.jobs.row.digest.hex());
  std::size_t daughters = 0;
  for (const Json& item : json["items"]) {
    for (const Json& id : item["daughter_ids"]) {
      ++daughters;
      EXPECT_EQ(json["items"][id.get<std::size_t>() - 1]["parent_id"], item["cell_id"]);
    }
  }
  EXPECT_EQ(daughters, 5u);
  EXPECT_TRUE(json["items"][0]["parent_id"].is_null());
  for (const Event& event : fixture.jobs.history) {
    if (const auto* const division = std::get_if<Divided>(&event.body)) {
      EXPECT_EQ(json["items"][division->cells[1].id.value - 1]["born_h"].get<double>(), event.time_h);
    }
  }
}

TEST(Lineage, OfAPastTimeEndsThere) {
  ApiFixture fixture;
  auto response = fixture.get(kJob + "/lineage?at_h=0", {{"Accept", "text/plain"}});
  EXPECT_EQ(body_of(response), "1:0;\n");
  auto early = fixture.get(kJob + "/lineage?at_h=1e8");
  EXPECT_EQ(early.status, 409);
  auto missing = fixture.get("/v1/jobs/nobody/lineage");
  EXPECT_EQ(missing.status, 404);
  auto wrong = fixture.get(kJob + "/lineage", {{"Accept", "image/png"}});
  EXPECT_EQ(wrong.status, 406);
}

TEST(Lineage, ADeepTreeNeedsNoStack) {
  const auto depth = static_cast<std::uint32_t>(colony::testing::scaled(100'000, 1'000'000));
  for (const bool by_daughters : {true, false}) {
    Lineage lineage;
    lineage.add(founded(1, 0));
    for (std::uint32_t id = 2; id <= depth; ++id) lineage.add(divided(by_daughters ? id - 1 : 1, id, id - 1));
    std::vector<Node> nodes;
    const auto roots = parse_newick(newick(std::move(lineage), depth), nodes);
    ASSERT_EQ(roots.size(), 1u);
    const auto depths = leaf_depths(nodes, roots[0]);
    ASSERT_EQ(depths.size(), depth);
    for (const auto& [name, length] : depths) ASSERT_EQ(length, depth) << name;
  }
}

}  // namespace
}  // namespace colony::server::testing
