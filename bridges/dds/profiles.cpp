#include "bridges/dds/profiles.h"

#include <filesystem>
#include <fstream>
#include <mutex>
#include <utility>

#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/log/Log.hpp>

#include "bridges/dds/library_log.h"

namespace linegate::dds {
namespace {

namespace fast = eprosima::fastdds::dds;

// Wherever the programs are installed; the Debian package puts a copy there to be edited.
constexpr const char* kOperatorsFile = "/etc/linegate/linegate-profiles.xml";

Severity severity(fast::Log::Kind kind) {
  switch (kind) {
    case fast::Log::Kind::Error:
      return Severity::error;
    case fast::Log::Kind::Warning:
      return Severity::warning;
    case fast::Log::Kind::Info:
      break;
  }
  return Severity::note;
}

class Consumer : public fast::LogConsumer {
 public:
  explicit Consumer(LibraryLog log) : log_(std::move(log)) {}

  void Consume(const fast::Log::Entry& entry) override {
    if (log_)
      log_(severity(entry.kind), entry.message);
  }

 private:
  LibraryLog log_;
};

void replace_consumer(LibraryLog log) {
  fast::Log::Flush();
  fast::Log::ClearConsumers();
  fast::Log::RegisterConsumer(std::make_unique<Consumer>(std::move(log)));
}

// The library's settings are those of the process, and so is what we know of them.
struct LibraryState {
  std::mutex mutex;
  std::string loaded;  // what the profiles came from, empty = not loaded
  LibraryLog log;
  bool log_taken = false;
};

LibraryState& library() {
  static LibraryState state;
  return state;
}

// Runs `load` and gives what the library said meanwhile: it returns no reasons.
template <class Load>
bool listen(Load load, std::string& said) {
  std::mutex mutex;
  replace_consumer([&](Severity, std::string_view text) {
    const std::lock_guard lock(mutex);
    if (!said.empty())
      said += "; ";
    said += text;
  });
  const bool ok = load();
  LibraryState& state = library();
  if (state.log_taken) {
    replace_consumer(state.log);
  } else {
    fast::Log::Flush();
    fast::Log::Reset();
  }
  const std::lock_guard lock(mutex);
  return ok;
}

Diagnostic problem(const std::string& file, std::string text) {
  return Diagnostic{Severity::error, file, 0, 0, std::move(text)};
}

std::string choose(const std::string& file) {
  if (!file.empty())
    return file;
  for (const char* known : {kOperatorsFile, LINEGATE_DDS_PROFILE_FILE}) {
    std::error_code error;
    if (std::filesystem::exists(known, error))
      return known;
  }
  return "(built-in linegate-profiles.xml)";
}

bool load(const std::string& origin, bool built_in, std::string& said) {
  return listen(
      [&] {
        auto* factory = fast::DomainParticipantFactory::get_instance();
        if (!built_in)
          return factory->load_XML_profiles_file(origin) == ReturnCode_t::RETCODE_OK;
        const std::string_view text = built_in_profiles();
        return factory->load_XML_profiles_string(text.data(), text.size()) ==
               ReturnCode_t::RETCODE_OK;
      },
      said);
}

}  // namespace

void set_library_log(LibraryLog log) {
  LibraryState& state = library();
  const std::lock_guard lock(state.mutex);
  state.log = std::move(log);
  state.log_taken = true;
  fast::Log::SetVerbosity(fast::Log::Kind::Warning);
  replace_consumer(state.log);
}

std::optional<std::string> load_profiles(const std::string& file,
                                         std::vector<Diagnostic>& diagnostics) {
  LibraryState& state = library();
  const std::lock_guard lock(state.mutex);
  const std::string origin = choose(file);
  if (state.loaded == origin)
    return origin;
  if (!state.loaded.empty()) {
    diagnostics.push_back(
        problem(origin, "this process runs with DDS profiles of " + state.loaded + " already"));
    return std::nullopt;
  }
  const bool built_in = file.empty() && origin.front() == '(';
  if (!built_in && !std::ifstream(origin)) {
    diagnostics.push_back(problem(origin, "cannot read the file of DDS profiles"));
    return std::nullopt;
  }
  std::string said;
  if (!load(origin, built_in, said)) {
    diagnostics.push_back(problem(
        origin, "not a usable file of DDS profiles: " + (said.empty() ? "no reason given" : said)));
    return std::nullopt;
  }
  state.loaded = origin;
  return origin;
}

}  // namespace linegate::dds
