// Handlers of what a job has produced: events, cells, series, lineage, log.
#include <algorithm>
#include <limits>

#include "server/api/api.hpp"
#include "server/api/event_text.hpp"
#include "server/api/lineage.hpp"
#include "server/api/streams.hpp"

namespace colony::server::api {
namespace {

Error wrong_parameter(std::string name, std::string message) {
  return {ErrorCode::kInvalid, "query parameters are wrong", {{std::move(name), std::move(message)}}};
}

http::Response streamed(std::string_view media, std::unique_ptr<http::BodySource> source) {
  http::Response response;
  response.headers.set("Content-Type", content_type(media));
  response.stream = std::move(source);
  return response;
}

// The kinds asked for; `progress` apart.
void read_kinds(const Query& query, StreamWish& wish) {
  const auto text = query.text("kind");
  if (!text) return;
  wish.progress = false;
  for (const std::string& name : split(*text, ',')) {
    if (name == "progress")
      wish.progress = true;
    else if (const auto kind = event_kind_from(name))
      wish.filter.kinds.push_back(*kind);
  }
  wish.events = !wish.filter.kinds.empty();
}

http::Response live_stream(Context& context, const Call& call, StreamWish wish) {
  if (call.query.has("limit")) return failure(wrong_parameter("limit", "is not for text/event-stream"), call);
  bool is_resumed = call.query.has("after");
  constexpr std::string_view kLastEventId = "Last-Event-ID";
  if (call.request.headers.count(kLastEventId) > 0) {
    const auto seq = parse_integer(*call.request.headers.get(kLastEventId));
    if (!seq || call.request.headers.count(kLastEventId) > 1 ||
        *seq > static_cast<std::uint64_t>(std::numeric_limits<std::int64_t>::max())) {
      return failure(
          {ErrorCode::kInvalid, "a header is wrong", {{std::string(kLastEventId), "must be the seq of an event"}}},
          call);
    }
    is_resumed = true;
    wish.filter.after = std::max(wish.filter.after, *seq);
  }
  const auto view = context.jobs.show(call.id());
  if (!view) return failure(view.error(), call);
  if (is_resumed && is_terminal(view->job.state)) {
    bool is_left = wish.filter.after < view->job.last_seq && !wish.events;  // progress alone: its end was not seen
    if (wish.events) {
      const auto rest = context.jobs.events(call.id(), wish.filter, 1);
      if (!rest) return failure(rest.error(), call);
      is_left = !rest->empty();
    }
    if (!is_left) {
      http::Response response;
      response.status = 204;
      return response;
    }
  }
  http::Response response =
      streamed("text/event-stream", std::make_unique<EventStream>(context.jobs, *context.feeds, *view, std::move(wish)));
  response.headers.set("Cache-Control", "no-store");
  response.headers.set("X-Accel-Buffering", "no");  // nginx would keep events back
  return response;
}

}  // namespace

http::Response get_events(Context& context, const Call& call) {
  StreamWish wish;
  wish.filter.after = call.query.integer("after").value_or(0);
  if (const auto cell_id = call.query.integer("cell_id")) wish.filter.cell_id = static_cast<std::uint32_t>(*cell_id);
  read_kinds(call.query, wish);
  if (call.media == "text/event-stream") return live_stream(context, call, std::move(wish));
  if (call.query.has("kind") && wish.progress) {
    return failure(wrong_parameter("kind", "progress is for Accept: text/event-stream only"), call);
  }
  std::optional<std::size_t> limit = call.query.integer("limit");
  if (!limit && call.media == "application/json") limit = kEventsPerPageDefault;
  const auto moment = context.jobs.moment(call.id(), std::nullopt);
  if (!moment) return failure(moment.error(), call);
  // Of a live job the same page can have one more event a moment later.
  const bool is_fixed = is_terminal(moment->job.state);
  const std::string tag = derived_tag(context, call, moment->digest, moment->seq);
  if (is_fixed) {
    if (auto settled = settled_by_tag(call, tag)) return std::move(*settled);
  }
  auto first = context.jobs.events(call.id(), wish.filter, kEventsPerRead);
  if (!first) return failure(first.error(), call);
  http::Response response = streamed(call.media, std::make_unique<EventListSource>(context.jobs, call.id(), wish.filter, limit,
                                                                                   event_format(call.media), std::move(*first)));
  if (is_fixed) stamp(response, tag);
  if (limit) {
    const auto end = context.jobs.page_end(call.id(), wish.filter, *limit);
    if (!end) return failure(end.error(), call);
    if (*end) set_next_link(context, call, response, "after", std::to_string(**end));
  }
  return response;
}

http::Response get_cells(Context& context, const Call& call) {
  if (auto settled = settled_by_history(context, call)) return std::move(*settled);
  auto at = context.jobs.colony_at(call.id(), call.query.number("at_h"));
  if (!at) return failure(at.error(), call);
  const std::string tag = history_tag(context, call, *at);
  const Json facts = {{"time_h", at->time_h}, {"last_seq", at->colony->last_seq()}, {"digest", at->digest.hex()}};
  http::Response response =
      streamed(call.media, std::make_unique<CellListSource>(std::move(*at), cell_format(call.media, facts)));
  stamp(response, tag);
  return response;
}

http::Response get_series(Context& context, const Call& call) {
  const auto before = context.jobs.moment(call.id(), std::nullopt);
  if (!before) return failure(before.error(), call);
  const std::string tag = derived_tag(context, call, before->digest, before->seq);
  if (auto settled = settled_by_tag(call, tag)) return std::move(*settled);
  const auto rows = context.jobs.series(call.id(), call.query.integer("points").value_or(kSeriesPointsDefault));
  if (!rows) return failure(rows.error(), call);
  http::Response response;
  if (call.media == "text/csv") {
    response.headers.set("Content-Type", content_type(call.media));
    append_csv_header(response.body, series_columns());
    for (const SeriesRow& row : *rows) append_csv_row(response.body, series_columns(), row);
  } else {
    Json items = Json::array();
    for (const SeriesRow& row : *rows) items.push_back(encode_row(series_columns(), row));
    response = json_response(200, {{"items", std::move(items)}, {"next", nullptr}});
  }
  // The rows are of the job as it was when they were read: of one that went on meanwhile it cannot be said which.
  const auto after = context.jobs.moment(call.id(), std::nullopt);
  if (after && after->seq == before->seq) stamp(response, tag);
  return response;
}

http::Response get_lineage(Context& context, const Call& call) {
  if (auto settled = settled_by_history(context, call)) return std::move(*settled);
  auto at = context.jobs.colony_at(call.id(), call.query.number("at_h"));
  if (!at) return failure(at.error(), call);
  auto lineage = read_lineage(context.jobs, call.id(), at->colony->last_seq(), call.stop(context));
  if (!lineage) return failure(lineage.error(), call);
  std::unique_ptr<http::BodySource> source;
  if (call.media != "application/json") {
    source = std::make_unique<NewickSource>(std::move(*lineage), at->time_h);
  } else {
    const Json facts = {{"time_h", at->time_h}, {"last_seq", at->colony->last_seq()}, {"digest", at->digest.hex()}};
    source = std::make_unique<LineageTableSource>(std::move(*lineage), at->colony, facts);
  }
  http::Response response = streamed(call.media, std::move(source));
  stamp(response, history_tag(context, call, *at));
  return response;
}

http::Response get_log(Context& context, const Call& call) {
  auto first = context.jobs.log(call.id(), 0, kLogRowsPerRead);
  if (!first) return failure(first.error(), call);
  return streamed(call.media, std::make_unique<LogSource>(context.jobs, call.id(), std::move(*first)));
}

}  // namespace colony::server::api
