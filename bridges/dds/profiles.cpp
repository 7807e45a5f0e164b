// SPDX-License-Identifier: Apache-2.0
#include "bridges/dds/profiles.h"

#include <filesystem>
#include <fstream>
#include <iterator>
#include <mutex>
#include <utility>

#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/log/Log.hpp>

#include "bridges/dds/library_log.h"
#include "bridges/dds/profile_text.h"

namespace linegate::dds {
namespace {

namespace fast = eprosima::fastdds::dds;

// Independent of where the programs are installed; the Debian package installs a copy there for
// editing.
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

// The library's profiles are global to the process, and so is this record of them.
struct LibraryState {
  std::mutex mutex;
  std::optional<LoadedProfiles> loaded;
  LibraryLog log;
  bool log_taken = false;
};

LibraryState& library() {
  static LibraryState state;
  return state;
}

// Runs `load` and returns the messages that the library logged meanwhile, because it returns no
// reasons.
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

// The library names the element that it rejects ("... Name: durabilty"), but not its line.
std::uint32_t line_of(std::string_view said, std::string_view xml) {
  constexpr std::string_view kName = "Name: ";
  const std::size_t at = said.find(kName);
  if (at == std::string_view::npos)
    return 0;
  const std::string_view rest = said.substr(at + kName.size());
  return line_of_element(xml, rest.substr(0, rest.find_first_of(" ;,\n")));
}

std::string read_all(std::ifstream file) {
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

bool load(const std::string& xml, std::string& said) {
  return listen(
      [&] {
        auto* factory = fast::DomainParticipantFactory::get_instance();
        return factory->load_XML_profiles_string(xml.data(), xml.size()) ==
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

std::string profiles_in_use(const std::string& file) {
  if (!file.empty())
    return file;
  for (const char* known : {kOperatorsFile, LINEGATE_DDS_PROFILE_FILE}) {
    std::error_code error;
    if (std::filesystem::exists(known, error))
      return known;
  }
  return "(built-in linegate-profiles.xml)";
}

std::optional<LoadedProfiles> load_profiles(const std::string& file,
                                            std::vector<Diagnostic>& diagnostics) {
  LibraryState& state = library();
  const std::lock_guard lock(state.mutex);
  LoadedProfiles loaded{profiles_in_use(file), {}};
  if (state.loaded && state.loaded->origin == loaded.origin)
    return state.loaded;
  const auto fail = [&](Diagnostic why) {
    diagnostics.push_back(std::move(why));
    return std::nullopt;
  };
  if (state.loaded)
    return fail(problem(loaded.origin, "this process runs with DDS profiles of " +
                                           state.loaded->origin + " already"));
  const bool built_in = file.empty() && loaded.origin.front() == '(';
  std::ifstream stream(loaded.origin);
  if (!built_in && (!stream || !std::filesystem::is_regular_file(loaded.origin)))
    return fail(problem(loaded.origin, "cannot read the file of DDS profiles"));
  loaded.text = built_in ? std::string(built_in_profiles()) : read_all(std::move(stream));
  constexpr std::string_view kUnusable = "not a usable file of DDS profiles: ";
  if (const auto xml = xml_problem(loaded.text))
    return fail({Severity::error, loaded.origin, xml->line, xml->column,
                 std::string(kUnusable) + xml->text});
  if (const auto line = line_of_multicast_locators(loaded.text, kParticipantProfile); line != 0)
    return fail({Severity::error, loaded.origin, line, 0,
                 "max_multicast_locators is not 0: in Fast DDS 2.9 two readers that announce a "
                 "unicast and the same multicast locator end the process; set it to 0 or leave it "
                 "out"});
  std::string said;
  if (!load(loaded.text, said))
    return fail({Severity::error, loaded.origin, line_of(said, loaded.text), 0,
                 std::string(kUnusable) + (said.empty() ? "no reason given" : said)});
  state.loaded = std::move(loaded);
  return state.loaded;
}

}  // namespace linegate::dds
