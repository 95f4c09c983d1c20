#include "server/api/feed.hpp"

#include <algorithm>
#include <pthread.h>

#include "engine/base/check.hpp"
#include "server/api/codec_event.hpp"
#include "server/api/event_text.hpp"

namespace colony::server::api {
namespace {
constexpr std::size_t kSharedBytesMin =
    16 * 1024;  // smaller ones are sent together: fewer writes for who is a little late
}  // namespace

void append_event_message(std::string& out, const Event& event) {
  ((out += "event: ") += name_of(event.kind())) += "\nid: ";
  (out += std::to_string(event.seq)) += "\ndata: ";
  append_event_text(out, event);
  out += "\n\n";
}

std::string progress_text(const JobView& view) {
  Json data = {{"state", name_of(view.job.state)}, {"last_seq", view.job.last_seq}};
  data.update(encode_progress(view.progress));
  return to_text(data);
}

Feed::Subscription::Subscription(Feed& feed, std::function<void()> wake) : feed_(feed), wake_(std::move(wake)) {
  const std::lock_guard lock(feed_.watchers_mutex_);
  feed_.watchers_.insert(this);
}

Feed::Subscription::~Subscription() {
  const std::lock_guard lock(feed_.watchers_mutex_);
  feed_.watchers_.erase(this);
}

Feed::Feed(Feeds& feeds, Wish wish) : feeds_(feeds), wish_(std::move(wish)) {}

// First the hub, so that nobody calls for a feed that is gone.
Feed::~Feed() {
  hub_.reset();
  feeds_.forget(*this);
}

std::unique_ptr<Feed::Subscription> Feed::subscribe(std::function<void()> wake) {
  return std::make_unique<Subscription>(*this, std::move(wake));
}

void Feed::wake_all() const {
  const std::lock_guard lock(watchers_mutex_);
  for (const Subscription* watcher : watchers_) watcher->wake();
}

std::chrono::microseconds Feed::pause() const {
  const std::lock_guard lock(watchers_mutex_);
  return std::min<std::chrono::microseconds>(kPauseMax, kPausePerWatcher * watchers_.size());
}

Feed::News Feed::after(std::uint64_t position, std::string& out) const {
  const std::lock_guard lock(mutex_);
  News news;
  news.position = position;
  news.through = through_;
  if (is_gone_) {
    news.kind = News::Kind::kGone;
    return news;
  }
  if (!from_ || position < *from_) return news;
  news.job = job_;
  auto piece = std::upper_bound(pieces_.begin(), pieces_.end(), position,
                                [](std::uint64_t seq, const Piece& one) { return seq < one.through; });
  const bool is_whole = piece != pieces_.end() && piece->from == position;
  if (is_whole && (std::next(piece) == pieces_.end() || piece->text->size() >= kSharedBytesMin)) {
    news.piece = piece->text;  // what nearly every watcher needs nearly always
    news.position = piece->through;
    ++piece;
  } else {
    const std::size_t size_before = out.size();
    for (; piece != pieces_.end(); ++piece) {
      const bool is_full = out.size() > size_before && out.size() - size_before + piece->text->size() > kPieceBytes;
      if (is_full) break;
      const auto first = std::upper_bound(piece->marks.begin(), piece->marks.end(), news.position,
                                          [](std::uint64_t seq, const auto& mark) { return seq < mark.first; });
      if (first != piece->marks.end()) out.append(*piece->text, first->second);
      news.position = piece->through;
    }
  }
  // A position may be ahead: the store was read later than the feed.
  news.kind = piece == pieces_.end() ? News::Kind::kAll : News::Kind::kMore;
  news.position = news.kind == News::Kind::kAll ? std::max(position, through_) : news.position;
  return news;
}

bool Feed::read_events(JobService& jobs, std::uint64_t last_seq, std::vector<Piece>& pieces) {
  EventFilter filter = wish_.filter;
  std::string text;
  Piece piece;
  piece.from = filter.after = read_through_;
  const auto close = [&](std::uint64_t through) {
    if (text.empty()) return;
    piece.through = through;
    text.shrink_to_fit();
    piece.text = std::make_shared<const std::string>(std::exchange(text, {}));
    pieces.push_back(std::exchange(piece, {}));
    piece.from = through;
  };
  // Beyond last_seq there may be more by now; what comes with a page is taken, but no page is read for it: a job that is faster than
  // this loop would never let it end.
  for (bool is_last_page = false; !is_last_page && filter.after < last_seq;) {
    const auto page = jobs.events(wish_.id, filter, kEventsPerRead);
    if (!page) return false;
    is_last_page = page->size() < kEventsPerRead;
    for (const Event& event : *page) {
      piece.marks.emplace_back(event.seq, text.size());
      append_event_message(text, event);
      filter.after = event.seq;
      if (text.size() >= kPieceBytes) close(event.seq);
    }
  }
  read_through_ = std::max(last_seq, filter.after);
  close(read_through_);
  return true;
}

void Feed::refresh(JobService& jobs) {
  // The state is read before the events: a terminal state is committed with the last event, so if it is seen, every event is.
  const auto view = jobs.show(wish_.id);
  std::vector<Piece> pieces;
  bool is_read = static_cast<bool>(view);
  if (is_read && !has_begun_) read_through_ = view->job.last_seq;  // who comes earlier reads the store
  if (is_read && has_begun_ && wish_.events) is_read = read_events(jobs, view->job.last_seq, pieces);
  if (is_read && !wish_.events) read_through_ = view->job.last_seq;
  // A reading that failed half way gives nothing: the next begins where this one did, and would give the same events again.
  if (!is_read) pieces.clear();
  std::shared_ptr<const WatchedJob> job;
  if (is_read) {
    job = std::make_shared<const WatchedJob>(
        WatchedJob{view->job.state, view->job.reason, view->job.last_seq, progress_text(*view)});
  }
  {
    const std::lock_guard lock(mutex_);
    is_gone_ = !is_read;
    job_ = std::move(job);
    if (is_read) {
      if (!from_) from_ = read_through_;
      through_ = read_through_;
    }
    for (Piece& piece : pieces) {
      bytes_ += piece.text->size();
      pieces_.push_back(std::move(piece));
    }
    while (bytes_ > kFeedBytesMax) {
      bytes_ -= pieces_.front().text->size();
      from_ = pieces_.front().through;
      pieces_.pop_front();
    }
  }
  has_begun_ = has_begun_ || is_read;
  wake_all();
}

Feeds::~Feeds() {
  {
    const std::lock_guard lock(mutex_);
    ending_ = true;
  }
  changed_.notify_all();
  if (thread_.joinable()) thread_.join();
  CHECK(known_.empty());
}

Feeds::Key Feeds::key_of(const Feed::Wish& wish) {
  std::vector<EventKind> kinds = wish.events ? wish.filter.kinds : std::vector<EventKind>();
  std::sort(kinds.begin(), kinds.end());
  kinds.erase(std::unique(kinds.begin(), kinds.end()), kinds.end());
  return {wish.job_key, wish.events, std::move(kinds), wish.events ? wish.filter.cell_id : std::nullopt};
}

std::shared_ptr<Feed> Feeds::find(const Feed::Wish& wish) {
  const Key key = key_of(wish);
  std::shared_ptr<Feed> feed;
  {
    const std::lock_guard lock(mutex_);
    Known& known = known_[key];
    if (auto there = known.feed.lock()) return there;
    feed = std::make_shared<Feed>(*this, wish);
    known = Known();
    known.feed = feed;
    if (mode_ == Mode::kOwnThread && !thread_.joinable()) thread_ = std::thread([this] { loop(); });
  }
  // Outside the lock: the hub calls mark_stale() under its own.
  feed->hub_ = jobs_.subscribe(wish.job_key, [this, key] { mark_stale(key); });
  mark_stale(key);
  return feed;
}

void Feeds::mark_stale(const Key& key) {
  {
    const std::lock_guard lock(mutex_);
    const auto known = known_.find(key);
    if (known == known_.end() || known->second.is_stale) return;
    known->second.is_stale = true;
  }
  changed_.notify_one();
}

// Its place may have a successor already.
void Feeds::forget(const Feed& feed) {
  const std::lock_guard lock(mutex_);
  const auto known = known_.find(key_of(feed.wish_));
  if (known != known_.end() && known->second.feed.expired()) known_.erase(known);
}

void Feeds::refresh_stale() {
  std::vector<std::shared_ptr<Feed>> stale;
  {
    const std::lock_guard lock(mutex_);
    for (auto& [key, known] : known_) {
      if (!std::exchange(known.is_stale, false)) continue;
      if (auto feed = known.feed.lock()) stale.push_back(std::move(feed));
    }
  }
  for (const auto& feed : stale) feed->refresh(jobs_);
}

void Feeds::loop() {
  pthread_setname_np(pthread_self(), "feeds");  // as operators see it, per thread
  std::unique_lock lock(mutex_);
  while (!ending_) {
    auto next = known_.end();  // of those with news the one that was due first: a fast job does not keep others waiting
    for (auto known = known_.begin(); known != known_.end(); ++known) {
      const bool is_earlier = next == known_.end() || known->second.not_before < next->second.not_before;
      if (known->second.is_stale && is_earlier) next = known;
    }
    if (next == known_.end()) {
      changed_.wait(lock);
      continue;
    }
    if (const auto due = next->second.not_before; due > Clock::now()) {
      changed_.wait_until(lock, due);
      continue;
    }
    next->second.is_stale = false;  // before it is read: a commit meanwhile leads to another reading
    const Key key = next->first;
    std::shared_ptr<Feed> feed = next->second.feed.lock();
    lock.unlock();
    std::chrono::microseconds pause{0};
    if (feed) {
      feed->refresh(jobs_);
      pause = feed->pause();
    }
    feed.reset();  // perhaps the last hold of it, and its end needs the lock
    lock.lock();
    if (const auto known = known_.find(key); known != known_.end()) known->second.not_before = Clock::now() + pause;
  }
}

}  // namespace colony::server::api
