#include <algorithm>
#include <cmath>
#include <filesystem>
#include <memory>
#include <optional>

#include <CLI/CLI.hpp>

#include "client/cli/commands.hpp"
#include "client/cli/founders.hpp"
#include "client/cli/output.hpp"

namespace colony::client {
namespace {

constexpr std::size_t kTableBytesMax = 1u << 30;
constexpr const char* kDishAuto = "auto";
constexpr const char* kDishPreset = "preset";
constexpr double kDishMargin_um = 100.0;  // room for a founder's body and its descendants at the rim

struct FounderFlags {
  FounderOptions founders;
  std::string table, output, um_per_px, time, field_px, y_axis = "down", min_distance = "0", dish_radius;
  std::string until_time, seed, preset = "clonogenic", name, delimiter;
};

double positive_option(const std::string& option, const std::string& text) {
  const double value = number_option(option, text);
  if (value <= 0) throw Failure(ExitCode::kUsage, option + ": must be greater than 0, not " + text);
  return value;
}

std::string dish_of(const FounderFlags& flags) {
  if (!flags.dish_radius.empty()) return flags.dish_radius;
  return flags.preset == "clonogenic" ? kDishAuto : kDishPreset;
}

FounderOptions options_of(const FounderFlags& flags) {
  FounderOptions options = flags.founders;
  options.um_per_px = positive_option("--um-per-px", flags.um_per_px);
  if (!flags.time.empty()) options.time = number_option("--time", flags.time);
  if (options.without_time && (options.time || !options.time_column.empty())) {
    throw Failure(ExitCode::kUsage, "--no-time: not together with --time or --time-column");
  }
  if (!flags.field_px.empty()) {
    const std::size_t by = flags.field_px.find('x');
    if (by == std::string::npos) throw Failure(ExitCode::kUsage, "--field-px: write it as WIDTHxHEIGHT, as 2240x2240");
    options.field_px = {positive_option("--field-px", flags.field_px.substr(0, by)),
                        positive_option("--field-px", flags.field_px.substr(by + 1))};
  }
  options.y_up = flags.y_axis == "up";
  options.min_distance_um = number_option("--min-distance-um", flags.min_distance);
  if (options.min_distance_um < 0) throw Failure(ExitCode::kUsage, "--min-distance-um: must not be negative");
  const std::string dish = dish_of(flags);
  if (dish != kDishAuto && dish != kDishPreset) {
    options.dish_radius_um = positive_option("--dish-radius-um", dish);
  }
  return options;
}

/// The farthest founder and a margin, up to the next 100 um.
double dish_around(const std::vector<Founder>& founders) {
  double farthest_um = 0.0;
  for (const Founder& founder : founders) farthest_um = std::max(farthest_um, std::hypot(founder.x_um, founder.y_um));
  return std::ceil((farthest_um + kDishMargin_um) / 100.0) * 100.0;
}

ExitCode make_spec(Session& session, const FounderFlags& flags) {
  FounderOptions options = options_of(flags);
  const double until_h = positive_option("--until-time", flags.until_time);
  const std::int64_t seed = integer_option("--seed", flags.seed);
  const std::string text = read_input(session.env, flags.table, kTableBytesMax);
  const std::string file =
      flags.table == "-" ? "standard input" : std::filesystem::path(flags.table).filename().string();
  char delimiter = guess_delimiter(text);
  if (!flags.delimiter.empty()) delimiter = flags.delimiter == "tab" ? '\t' : flags.delimiter[0];
  const Founders founders = select_founders(parse_csv(text, file, delimiter), options);
  if (dish_of(flags) == kDishAuto) options.dish_radius_um = dish_around(founders.kept);

  Json spec;
  spec["name"] = flags.name.empty() ? "founders of " + file : flags.name;
  spec["preset"] = flags.preset;
  spec["seed"] = seed;
  spec["until"]["time_h"] = until_h;
  if (options.dish_radius_um) spec["model"]["dish"]["radius_um"] = *options.dish_radius_um;
  Json& positions = spec["model"]["founders"]["positions_um"] = Json::array();
  for (const Founder& founder : founders.kept) positions.push_back({founder.x_um, founder.y_um});

  Output output(session.env, flags.output);
  output.write(pretty(spec));
  output.finish();
  session.env.err << founders_report(founders, options);
  return ExitCode::kDone;
}

}  // namespace

void add_founders_command(CLI::App& app, Session& session, Action& action) {
  auto flags = std::make_shared<FounderFlags>();
  FounderOptions& founders = flags->founders;
  CLI::App* command =
      app.add_subcommand("founders", "Turn a colony-tracking table into a job spec: one founder for each colony");
  command->add_option("TRACKS", flags->table, "CSV table with a header, or - for standard input")->required();
  command->add_option("--um-per-px", flags->um_per_px, "Scale of the table's positions, um in a pixel")->required();
  command->add_option("--until-time", flags->until_time, "End of the job at this model time, h")->required();
  command->add_option("--seed", flags->seed, "Seed of all random streams")->required();
  command->add_option("--preset", flags->preset, "Named set of parameters")->capture_default_str();
  command->add_option("--name", flags->name, "Name of the job (default: from the file's)");
  command->add_option("--time-column", founders.time_column, "Column of the time (default: found by its name)");
  command->add_option("--x-column", founders.x_column, "Column of x (default: found by its name)");
  command->add_option("--y-column", founders.y_column, "Column of y (default: found by its name)");
  command->add_option("--track-column", founders.track_column,
                      "Column that names the colony (default: found by its name)");
  command->add_option("--time", flags->time, "Take the rows of this time (default: the earliest)");
  command->add_flag("--no-time", founders.without_time, "The whole table is one moment");
  command->add_option("--field-px", flags->field_px,
                      "Origin at the middle of an image WIDTHxHEIGHT (default: at the mean position)");
  command->add_option("--y-axis", flags->y_axis, "Where y of the table runs: down as image rows, or up")
      ->check(CLI::IsMember({"down", "up"}))
      ->capture_default_str();
  command
      ->add_option("--min-distance-um", flags->min_distance,
                   "Drop, and report, the later of two closer than this (0: off)")
      ->capture_default_str();
  command->add_option(
      "--dish-radius-um", flags->dish_radius,
      "Wall of the dish around the origin: a radius, auto (just beyond the farthest founder) or preset (default: auto for preset "
      "clonogenic, whose wall real colonies may cross, else preset)");
  command->add_option("--delimiter", flags->delimiter, "Between fields: , ; or tab (default: found in the header)")
      ->check(CLI::IsMember({",", ";", "tab"}));
  command->add_option("-o,--output", flags->output, "File for the spec (default: standard output)");
  command->callback([&session, &action, flags] { action = [&session, flags] { return make_spec(session, *flags); }; });
}

}  // namespace colony::client
