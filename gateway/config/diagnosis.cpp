// SPDX-License-Identifier: Apache-2.0
#include "gateway/config/sections.h"
#include "stack/diagnosis/canopen_ia.h"
#include "stack/od/objects.h"

namespace linegate::config {

void read_diagnosis(Section& section, line::LineConfig& config) {
  section.read("strict_ixxat", config.strict_ixxat);
  section.read("keep_operational", config.keep_operational);
  const YAML::Node base = section.find("canopenia_base");
  if (const auto number =
          section.number(base, od::objects::kLowestCanopenIa, od::objects::kHighestCanopenIa)) {
    config.canopen_ia_base = static_cast<std::uint16_t>(*number);
    if (!diagnosis::is_free_for_records(config.canopen_ia_base)) {
      section.findings().error(place_of(base), "the records of canopenia_base would cover 5F80h");
    }
  }
}

}  // namespace linegate::config
