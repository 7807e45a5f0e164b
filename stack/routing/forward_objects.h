// SPDX-License-Identifier: Apache-2.0
// The forwarded objects of one line, in the dictionary of its own node, and the PDOs that map them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "stack/base/result.h"
#include "stack/image/process_image.h"
#include "stack/od/dictionary.h"
#include "stack/od/hook.h"
#include "stack/routing/forward.h"

namespace linegate::routing {

class ForwardObjects final : public od::Hook {
 public:
  // Both references must outlive this object, and this object the dictionary.
  ForwardObjects(const Forwarding& config, image::ProcessImage& image);

  // Adds the objects and the PDO records. Fails like Dictionary::add.
  Result<void> add_to(od::Dictionary& dictionary);

  // --- the forwarding list ----------------------------------------------------------------------

  // Updates the forwarding list from the mapping records if a PDO has changed since the last call
  // (revision: pdo::Engine::revision()); otherwise costs one comparison.
  void follow(const od::Dictionary& dictionary, std::uint64_t revision) {
    if (revision != revision_) {
      revision_ = revision;
      rebuild(dictionary);
    }
  }
  // The numbers of the PDOs that map an object. object: its position in Forwarding::objects. Valid
  // until the next follow().
  std::span<const std::uint16_t> rpdos(std::size_t object) const { return lists_[object].rpdos; }
  std::span<const std::uint16_t> tpdos(std::size_t object) const { return lists_[object].tpdos; }

  // od::Hook, for objects that are entries of the image
  AbortCode before_read(od::Address address, const od::Variable& variable) override;
  void written(od::Address address) override;

 private:
  struct List {
    std::vector<std::uint16_t> rpdos;
    std::vector<std::uint16_t> tpdos;
  };
  Result<void> add_index(od::Dictionary& dictionary, std::span<const ForwardedObject> objects,
                         bool shown);
  void rebuild(const od::Dictionary& dictionary);
  void note(const od::Dictionary& dictionary, pdo::PdoKind kind, std::uint16_t number);
  const ForwardedObject* find(od::Address address) const;

  const Forwarding& config_;
  image::ProcessImage& image_;
  std::vector<List> lists_;
  std::uint64_t revision_ = ~std::uint64_t{0};
};

}  // namespace linegate::routing
