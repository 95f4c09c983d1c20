#include "server/http/message.hpp"

#include <algorithm>

#include "server/http/text.hpp"

namespace colony::server::http {

void Headers::set(std::string_view name, std::string_view value) {
  const auto same = [name](const auto& item) { return equals_without_case(item.first, name); };
  items_.erase(std::remove_if(items_.begin(), items_.end(), same), items_.end());
  items_.emplace_back(name, value);
}

void Headers::add(std::string_view name, std::string_view value) { items_.emplace_back(name, value); }

std::optional<std::string_view> Headers::get(std::string_view name) const {
  for (const auto& [key, value] : items_) {
    if (equals_without_case(key, name)) return std::string_view(value);
  }
  return std::nullopt;
}

std::size_t Headers::count(std::string_view name) const {
  const auto same = [name](const auto& item) { return equals_without_case(item.first, name); };
  return static_cast<std::size_t>(std::count_if(items_.begin(), items_.end(), same));
}

}  // namespace colony::server::http
