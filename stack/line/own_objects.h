// SPDX-License-Identifier: Apache-2.0
// Application objects of the own node's dictionary: 2000h..5EFFh and 6000h..9FFFh, created by the
// configuration and by command (IXXAT CANopen Manager API manual 5.15). Private to stack/line.
//
// An object with a place in the image shares its bytes with the image: objects that other nodes may
// write are in the inputs, those that the application writes in the outputs.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "stack/base/diagnostic.h"
#include "stack/base/event_log.h"
#include "stack/base/result.h"
#include "stack/image/process_image.h"
#include "stack/line/command.h"
#include "stack/line/config.h"
#include "stack/od/dictionary.h"
#include "stack/od/hook.h"
#include "stack/pdo/link.h"

namespace linegate::line {

// Whether an application may create the object; 5F00h..5FFFh and all other indices belong to
// services.
constexpr bool is_own_index(std::uint16_t index) {
  return (index >= 0x2000 && index <= 0x5EFF) || (index >= 0x6000 && index <= 0x9FFF);
}

constexpr image::Direction direction_of(od::Access access) {
  return od::rpdo_mappable(access) ? image::Direction::inputs : image::Direction::outputs;
}

// Returns all errors of LineConfig::own_objects; their file is the line's name.
std::vector<Diagnostic> check_own_objects(const LineConfig& config);

// Adds image entries for the objects that need a place, behind those of PDOs, in the order of their
// addresses: node is the own node-ID, PDO numbers are 0. Precondition: check_own_objects() found
// nothing. Returns false if an area becomes larger than image::kMaxAreaBytes, or has more than
// image::kMaxEntries entries.
bool place_own_objects(const LineConfig& config, pdo::LinkPlan& plan);

class OwnObjects final : public od::Hook {
 public:
  // All must outlive it; the image has the entries of place_own_objects().
  OwnObjects(const std::vector<OwnObject>& objects, image::ProcessImage& image, EventLog& events);

  // Adds the configured objects. Fails as Dictionary::add does.
  Result<void> add_to(od::Dictionary& dictionary);

  // Adds one sub-index at run time; the other sub-indices keep their values. offset: in bytes, in
  // the area that direction_of() returns for its access; the bytes there become the value.
  // bad_request: the index is not that of an application object, the data type is invalid, the
  // offset is beyond the area, or the object is marked to be stored, although the next start could
  // not restore it. wrong_state: it exists, or its index is not of this class.
  Error create(od::Dictionary& dictionary, OwnObject object);
  // Removes all sub-indices that were created at run time. unknown_entry if there are none;
  // wrong_state if the configuration has some of the index.
  Error remove(od::Dictionary& dictionary, std::uint16_t index);

  // The node was reset: the values in the image became the defaults without a write.
  void values_reset();

  // The time of later writes.
  void pass_time(Instant now) { now_ = now; }
  // While an instance exists, writes come from the line itself and emit no event.
  class OwnWrites {
   public:
    explicit OwnWrites(OwnObjects& objects) : objects_(objects) { objects_.by_itself_ = true; }
    ~OwnWrites() { objects_.by_itself_ = false; }
    OwnWrites(const OwnWrites&) = delete;
    OwnWrites& operator=(const OwnWrites&) = delete;

   private:
    OwnObjects& objects_;
  };

  AbortCode execute_write(od::Address address, std::span<const std::byte> value) override;
  void written(od::Address address) override;

 private:
  struct Place {
    image::Direction direction = image::Direction::inputs;
    std::uint32_t offset = 0;  // bytes
    std::uint32_t size = 0;
  };
  std::optional<Place> configured_place(od::Address address) const;
  Result<void> add_index(od::Dictionary& dictionary, std::uint16_t index);
  void mark(const Place& place);

  image::ProcessImage& image_;
  EventLog& events_;
  Instant now_{};
  bool by_itself_ = false;
  std::map<od::Address, OwnObject> objects_;
  std::map<od::Address, Place> places_;
  std::set<std::uint16_t> configured_;
};

event::ObjectWritten written_event(od::Address address, std::span<const std::byte> value);

// LocalRead: the variables of the range, ascending, those of A000h..AFFFh only if its first index
// is one of them.
std::vector<ListedObject> list_objects(const od::Dictionary& dictionary, ObjectRange range);
// The same for a device file, with its values.
std::vector<ListedObject> list_objects(const od::DeviceDescription& device, ObjectRange range);

}  // namespace linegate::line
