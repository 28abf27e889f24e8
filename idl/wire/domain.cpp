#include "idl/wire/domain.hpp"

#include <dds/ddsrt/log.h>

#include <mutex>

#include "loopback_profile.hpp"  // generated from deploy/dds/loopback.xml

namespace slew::wire {

extern const bool kSteadyWaits;  // steady_waits.cpp

namespace {

// DDS reports a bad configuration to its log only. While a domain is created the log is collected, so that
// the words reach whoever asked.
class LogCapture {
 public:
  LogCapture() {
    dds_set_log_sink(&LogCapture::collect, this);
    dds_set_trace_sink(&LogCapture::collect, this);
  }
  ~LogCapture() {
    dds_set_log_sink(nullptr, nullptr);
    dds_set_trace_sink(nullptr, nullptr);
  }
  LogCapture(const LogCapture&) = delete;
  LogCapture& operator=(const LogCapture&) = delete;

  std::string text() {
    const std::lock_guard lock(mutex_);
    return text_;
  }

 private:
  static void collect(void* self, const dds_log_data_t* entry) {
    if ((entry->priority & (DDS_LC_FATAL | DDS_LC_ERROR | DDS_LC_WARNING | DDS_LC_CONFIG)) == 0) return;
    auto& capture = *static_cast<LogCapture*>(self);
    const std::lock_guard lock(capture.mutex_);
    if (capture.text_.size() < 4096) capture.text_.append(entry->message, entry->size);
  }

  std::mutex mutex_;
  std::string text_;
};

std::string in_words(const char* what, dds_return_t code, const std::string& log) {
  std::string sentence = std::string(what) + ": " + dds_strretcode(code);
  if (!log.empty()) sentence += "\n" + log;
  return sentence;
}

}  // namespace

const std::string& loopback_profile() {
  static const std::string profile = kLoopbackProfile;
  return profile;
}

bool Domain::minds_the_wall_clock() {
  return !kSteadyWaits;
}

Domain::Domain(const DomainOptions& options) : id_(options.domain) {
  if (options.domain < 1 || options.domain > kLargestDomain)
    throw WireError("the DDS domain must be between 1 and " + std::to_string(kLargestDomain) + ", not " +
                    std::to_string(options.domain));
  std::string profile = options.profile.empty() ? loopback_profile() : options.profile;
  if (!options.identity.empty()) profile = identity_.emplace(options.identity).joined_to(profile);

  LogCapture log;
  const dds_entity_t domain = dds_create_domain(options.domain, profile.c_str());
  if (domain < 0) throw WireError(in_words("the DDS configuration was refused", domain, log.text()));
  domain_ = Entity(domain);
  const dds_entity_t participant = dds_create_participant(options.domain, nullptr, nullptr);
  if (participant < 0)
    throw WireError(in_words(identity_ ? "DDS gave no participant to this identity (was it tampered with, or "
                                         "are all 100 places on this host taken?)"
                                       : "DDS gave no participant (are all 100 places on this host taken?)",
                             participant, log.text()));
  participant_ = Entity(participant);
}

}  // namespace slew::wire
