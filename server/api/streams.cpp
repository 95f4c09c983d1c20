#include "server/api/streams.hpp"

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "server/api/event_text.hpp"

namespace colony::server::api {
namespace {

constexpr auto kNoTail = [](const std::optional<std::string>&) { return std::string(); };

template <class Item>
using AppendText = void (*)(std::string& out, const Item& item);

template <class Item>
ListFormat<Item> lines_format(AppendText<Item> append) {
  return {"", "",
          [append](std::string& out, const Item& item) {
            append(out, item);
            out += '\n';
          },
          kNoTail};
}

template <class Item>
ListFormat<Item> csv_format(std::span<const Column<Item>> columns) {
  std::string head;
  append_csv_header(head, columns);
  return {head, "", [columns](std::string& out, const Item& item) { append_csv_row(out, columns, item); }, kNoTail};
}

// {<facts>, "items": [...], "next": ...}
template <class Item>
ListFormat<Item> envelope_format(const Json& facts, AppendText<Item> append) {
  std::string head = to_text(facts);
  head.pop_back();
  head += facts.empty() ? "\"items\":[" : ",\"items\":[";
  return {head, ",", append, [](const std::optional<std::string>& next) {
            return "],\"next\":" + (next ? to_text(Json(*next)) : std::string("null")) + "}";
          }};
}

template <class Item>
ListFormat<Item> format_for(std::string_view media, const Json& facts, AppendText<Item> append,
                            std::span<const Column<Item>> columns) {
  if (media == "text/csv") return csv_format(columns);
  if (media == "application/x-ndjson") return lines_format<Item>(append);
  return envelope_format<Item>(facts, append);
}

}  // namespace

ListFormat<Event> event_format(std::string_view media) {
  return format_for(media, Json::object(), &append_event_text, event_columns());
}

ListFormat<Cell> cell_format(std::string_view media, const Json& facts) {
  return format_for(media, facts, &append_cell_text, cell_columns());
}

EventListSource::EventListSource(JobService& jobs, std::string id, EventFilter filter, std::optional<std::size_t> limit,
                                 ListFormat<Event> format, std::vector<Event> first)
    : jobs_(jobs),
      id_(std::move(id)),
      filter_(std::move(filter)),
      left_(limit),
      format_(std::move(format)),
      page_(std::move(first)) {}

http::BodySource::Pull EventListSource::pull(std::string& out) {
  if (is_first_) out += format_.head;
  std::optional<std::string> next;
  const auto read = [this](std::size_t limit) {
    auto more = jobs_.events(id_, filter_, limit);
    if (!more) throw std::runtime_error("events of a list that had begun: " + more.error().message);
    page_ = std::move(*more);
    used_ = 0;
  };
  while (!page_.empty()) {
    for (; used_ < page_.size() && out.size() < kPieceBytes && left_ != std::size_t{0}; ++used_) {
      if (!std::exchange(is_first_, false)) out += format_.separator;
      format_.append(out, page_[used_]);
      filter_.after = page_[used_].seq;
      if (left_) --*left_;
    }
    if (left_ == std::size_t{0}) {
      // The limit is reached: there is a next page if one more event is stored already.
      if (used_ == page_.size()) read(1);
      if (!page_.empty()) next = std::to_string(filter_.after);
      break;
    }
    if (used_ < page_.size()) return Pull::kMore;  // the piece is full
    read(kEventsPerRead);
    if (!page_.empty() && out.size() >= kPieceBytes) return Pull::kMore;
  }
  out += format_.tail(next);
  return Pull::kEnd;
}

http::BodySource::Pull CellListSource::pull(std::string& out) {
  const Paged<Cell>& cells = at_.colony->cells();
  if (next_ == 0) out += format_.head;
  for (; next_ < cells.size() && out.size() < kPieceBytes; ++next_) {
    if (next_ > 0) out += format_.separator;
    format_.append(out, cells[next_]);
  }
  if (next_ < cells.size()) return Pull::kMore;
  out += format_.tail(std::nullopt);
  return Pull::kEnd;
}

LogSource::LogSource(JobService& jobs, std::string id, std::vector<LogRow> first)
    : jobs_(jobs), id_(std::move(id)), page_(std::move(first)) {}

http::BodySource::Pull LogSource::pull(std::string& out) {
  if (page_.empty()) return Pull::kEnd;
  for (const LogRow& row : page_) out += to_text(encode_log_row(row)) + '\n';
  auto more = jobs_.log(id_, page_.back().index, kLogRowsPerRead);
  if (!more) throw std::runtime_error("the log of a list that had begun: " + more.error().message);
  page_ = std::move(*more);
  return page_.empty() ? Pull::kEnd : Pull::kMore;
}

EventStream::EventStream(JobService& jobs, Feeds& feeds, const JobView& view, StreamWish wish, Clock clock)
    : jobs_(jobs),
      feeds_(feeds),
      id_(view.job.id),
      job_key_(view.job.job_key),
      wish_(std::move(wish)),
      clock_(std::move(clock)) {}

void EventStream::on_ready(std::function<void()> wake) {
  feed_ = feeds_.find({id_, job_key_, wish_.events, wish_.filter});
  subscription_ = feed_->subscribe(std::move(wake));
}

void EventStream::append_progress(std::string& out, const WatchedJob& job, bool is_last) {
  wake_after_.reset();
  if (job.progress == last_progress_) return;
  const auto now = clock_();
  const bool is_news = is_last || last_state_ != job.state;
  if (const auto due = last_progress_at_.value_or(now - kProgressInterval) + kProgressInterval; !is_news && now < due) {
    // Nothing need happen after this: a job that pauses is silent. Rounded up, so that the next pull is not too early.
    wake_after_ = std::chrono::ceil<std::chrono::milliseconds>(due - now);
    return;
  }
  ((out += "event: progress\ndata: ") += job.progress) += "\n\n";
  last_progress_ = job.progress;
  last_state_ = job.state;
  last_progress_at_ = now;
}

// What follows the events of a piece. Without more of them all of the filter up to job.last_seq were sent.
http::BodySource::Pull EventStream::say(std::string& out, const WatchedJob& job, bool has_more) {
  const bool is_over = !has_more && is_terminal(job.state);
  if (wish_.progress) append_progress(out, job, is_over);
  if (has_more) return Pull::kMore;
  if (!is_over) return Pull::kWait;
  // A message without data is not shown to readers, but its id counts: a reader of progress alone, whose messages have
  // no id, then also comes back with Last-Event-ID, and gets 204.
  const Json end = {{"state", name_of(job.state)}, {"reason", job.reason}, {"last_seq", job.last_seq}};
  out += "id: " + std::to_string(job.last_seq) + "\n\nevent: end\ndata: " + to_text(end) + "\n\n";
  return Pull::kEnd;
}

std::optional<http::BodySource::Ready> EventStream::pull_now(std::string& out) {
  if (!feed_ || is_first_) return std::nullopt;
  const Feed::News news = feed_->after(wish_.filter.after, out);
  // Without `event: end` the reader reconnects and is told what became of the job.
  if (news.kind == Feed::News::Kind::kGone) return Ready{Pull::kEnd, nullptr};
  if (news.kind == Feed::News::Kind::kBehind) {
    if (!has_met_feed_ || news.through <= wish_.filter.after + kLagSeqsMax) return std::nullopt;
    // The ids sent so far stand; a reader that comes back with the last of them misses nothing.
    const Json lag = {{"sent_seq", wish_.filter.after}, {"last_seq", news.through}};
    out += "event: lagged\ndata: " + to_text(lag) + "\n\n";
    return Ready{Pull::kEnd, nullptr};
  }
  has_met_feed_ = true;
  wish_.filter.after = news.position;
  let_go_of_page();
  return Ready{say(out, *news.job, news.kind == Feed::News::Kind::kMore), news.piece};
}

// A stream that waits keeps nothing: a page is 200 kB, and there are a thousand streams. (An assignment of {} would keep the memory.)
void EventStream::let_go_of_page() {
  std::vector<Event>().swap(page_);
  next_ = 0;
}

http::BodySource::Pull EventStream::pull(std::string& out) {
  std::string own;
  if (const auto ready = pull_now(own)) {
    if (ready->shared) out += *ready->shared;
    out += own;
    return ready->pull;
  }
  if (std::exchange(is_first_, false)) out += "retry: 2000\n\n";
  return pull_stored(out);
}

http::BodySource::Pull EventStream::pull_stored(std::string& out) {
  // The state is read before the events: a terminal state is committed with the last event, so if it is seen and no
  // event is left after it, none will ever come.
  const auto view = jobs_.show(id_);
  // Deleted while it was watched, or the storage failed: without `event: end` the reader reconnects and is told.
  if (!view) return Pull::kEnd;
  const WatchedJob job{view->job.state, view->job.reason, view->job.last_seq, progress_text(*view)};
  if (wish_.events) {
    const bool is_fresh = next_ == page_.size();
    if (is_fresh) {
      auto events = jobs_.events(id_, wish_.filter, kEventsPerRead);
      if (!events) return Pull::kEnd;
      page_ = std::move(*events);
      next_ = 0;
    }
    // A page that is not full is all there was when it was read. If that was now, after the state, nothing more need be asked: what comes
    // later wakes. If it was in an earlier pull, whose piece was full, the job may have gone on and even ended since.
    const bool is_last_page = is_fresh && page_.size() < kEventsPerRead;
    const std::size_t size_before = out.size();
    for (; next_ < page_.size() && out.size() - size_before < kPieceBytes; ++next_) {
      append_event_message(out, page_[next_]);
      wish_.filter.after = page_[next_].seq;
    }
    if (!is_last_page || next_ < page_.size()) return say(out, job, true);
    let_go_of_page();
  }
  wish_.filter.after = std::max(wish_.filter.after, job.last_seq);
  return say(out, job, false);
}

}  // namespace colony::server::api
