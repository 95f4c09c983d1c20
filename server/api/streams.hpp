// streams: answers that are made piece by piece, so that their length costs no memory.
// Promise: events are read from the store in pages by seq, or once for all watchers (feed.hpp); no database transaction is
//          held across a wait. A live stream gives every event of its filter exactly once and in order; progress at most 5 times a second, but a
//          change of state at once, and the latest progress within 200 ms, also if nothing happens after it.
// Errors:  a failure after the first piece throws: the session cuts the connection without the last chunk, so that the
//          reader sees a truncated body, never a short one that looks whole.
// Threads: one pull at a time; wakes from any thread.
#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "server/api/codec_event.hpp"
#include "server/api/feed.hpp"
#include "server/http/message.hpp"
#include "server/jobs/service.hpp"

namespace colony::server::api {

/// A stream that had met its feed and is so many events behind it is cut: its reader is too slow, and gets the rest by reconnecting.
inline constexpr std::uint64_t kLagSeqsMax = 50'000;
inline constexpr std::chrono::milliseconds kProgressInterval{200};

/// The text around and of the items of a streamed list: a JSON envelope, lines of JSON, or CSV.
template <class Item>
struct ListFormat {
  std::string head;
  std::string separator;  // between two items
  std::function<void(std::string& out, const Item& item)> append;
  std::function<std::string(const std::optional<std::string>& next)> tail;
};

ListFormat<Event> event_format(std::string_view media);
/// `facts` is what a JSON envelope says beside the items.
ListFormat<Cell> cell_format(std::string_view media, const Json& facts);

/// Stored events, page by page, up to `limit`. `first` is the first page, read before the answer began, so that errors
/// had a status of their own.
class EventListSource : public http::BodySource {
 public:
  EventListSource(JobService& jobs, std::string id, EventFilter filter, std::optional<std::size_t> limit,
                  ListFormat<Event> format, std::vector<Event> first);
  Pull pull(std::string& out) override;

 private:
  JobService& jobs_;
  const std::string id_;
  EventFilter filter_;               // after moves on with every page
  std::optional<std::size_t> left_;  // of the limit
  const ListFormat<Event> format_;
  std::vector<Event> page_;
  std::size_t used_ = 0;  // of page_
  bool is_first_ = true;
};

class CellListSource : public http::BodySource {
 public:
  CellListSource(ColonyAt at, ListFormat<Cell> format) : at_(std::move(at)), format_(std::move(format)) {}
  Pull pull(std::string& out) override;

 private:
  const ColonyAt at_;
  const ListFormat<Cell> format_;
  std::size_t next_ = 0;
};

class LogSource : public http::BodySource {
 public:
  LogSource(JobService& jobs, std::string id, std::vector<LogRow> first);
  Pull pull(std::string& out) override;

 private:
  JobService& jobs_;
  const std::string id_;
  std::vector<LogRow> page_;
};

inline constexpr std::size_t kLogRowsPerRead = 500;

/// What a client wants of a live stream.
struct StreamWish {
  EventFilter filter;
  bool events = true;  // false: progress alone
  bool progress = true;
};

/// Server-sent events of one job. What is stored already is read here, page by page; from where that meets the feed of the job, pieces are the
/// feed's, shared with all who watch the same.
class EventStream : public http::BodySource {
 public:
  using Clock = std::function<std::chrono::steady_clock::time_point()>;
  EventStream(JobService& jobs, Feeds& feeds, const JobView& view, StreamWish wish,
              Clock clock = std::chrono::steady_clock::now);
  Pull pull(std::string& out) override;
  std::optional<Ready> pull_now(std::string& out) override;
  std::optional<std::chrono::milliseconds> wake_after() override { return wake_after_; }
  void on_ready(std::function<void()> wake) override;
  std::string_view keep_alive() const override { return ": keep-alive\n\n"; }
  std::string_view farewell() const override { return "event: bye\ndata: {}\n\n"; }

 private:
  Pull pull_stored(std::string& out);
  void let_go_of_page();
  Pull say(std::string& out, const WatchedJob& job, bool has_more);
  void append_progress(std::string& out, const WatchedJob& job, bool is_last);

  JobService& jobs_;
  Feeds& feeds_;
  const std::string id_;
  const std::int64_t job_key_;
  StreamWish wish_;  // filter.after: every event of the filter up to here was sent
  const Clock clock_;
  std::shared_ptr<Feed> feed_;
  std::unique_ptr<Feed::Subscription> subscription_;  // of feed_
  std::vector<Event> page_;                           // read from the store;
  std::size_t next_ = 0;                              // from here on not yet sent
  bool is_first_ = true;
  bool has_met_feed_ = false;
  std::string last_progress_;
  std::optional<JobState> last_state_;  // as said in it
  std::optional<std::chrono::steady_clock::time_point> last_progress_at_;
  std::optional<std::chrono::milliseconds> wake_after_;  // there is progress that had to wait
};

}  // namespace colony::server::api
