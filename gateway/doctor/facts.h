// SPDX-License-Identifier: Apache-2.0
// Questions that several checks ask the observations.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "gateway/doctor/observations.h"

namespace linegate::doctor {

// The gateway in the name of a participant, "hall" of "linegate hall"; empty: not a gateway.
std::string gateway_name(std::string_view participant);
// The announced gateways of the own domain that have not left.
std::vector<const Heard*> gateways_in_domain(const Observations& seen);
// Whether a gateway is seen in the own domain, by an announcement, by DDS or by a sample.
bool has_gateway(const Observations& seen);
// Whether all announced gateways of the own domain are on this host, and there is one: whether
// others reach them does not show.
bool has_only_local_gateways(const Observations& seen);
bool is_received(const Observations& seen, std::string_view gateway);

dds::ObservedPrefix prefix_of(const dds::ObservedEndpoint& endpoint);
// Whether endpoints of that participant were discovered.
bool has_endpoints(const Observations& seen, const dds::ObservedPrefix& prefix);
// Which endpoints belong to gateways.
std::vector<bool> of_gateways(const Observations& seen);
// "gateway 'hall'", "this program", or "'viewer' on host panel3".
std::string owner_text(const Observations& seen, const dds::ObservedEndpoint& endpoint);

// "1.5 s"
std::string seconds_text(Duration time);
// "gateway 'hall' from 10.0.0.1 (5 announcements)"
std::string heard_text(const Heard& heard);
// Foreign text: control characters and quotes are replaced. At most 256 characters.
std::string safe(std::string_view text);
// Whether a name of one list fits one of the other (DDS 1.4 2.2.3.13); an empty list has the
// default partition.
bool partitions_fit(const std::vector<std::string>& one, const std::vector<std::string>& other);
std::string partitions_text(const std::vector<std::string>& names);

}  // namespace linegate::doctor
