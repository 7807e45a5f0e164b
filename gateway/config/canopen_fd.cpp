// SPDX-License-Identifier: Apache-2.0
// canopen_fd, data_bit_rate, usdo_abort and emcy_fd of a line.
#include "gateway/config/sections.h"
#include "gateway/config/value.h"

namespace linegate::config {
namespace {

void read_data_bit_rate(Section& section, LinePlan& plan) {
  const YAML::Node rate = section.find("data_bit_rate");
  const auto text = section.text(rate);
  if (!text) {
    return;
  }
  if (const auto value = parse_bit_rate(*text)) {
    plan.config.data_bit_rate = *value;
    if (*value < plan.config.bit_rate) {
      section.findings().error(place_of(rate), "the data phase is not slower than bit_rate");
    }
  } else {
    section.findings().error(place_of(rate),
                             "expected a bit rate such as 5Mbit, got \"" + *text + "\"");
  }
  if (!plan.config.canopen_fd) {
    section.findings().error(place_of(rate),
                             "data_bit_rate needs canopen_fd: true: only CAN FD has a data phase");
  }
}

}  // namespace

void read_canopen_fd(Section& section, LinePlan& plan) {
  section.read("canopen_fd", plan.config.canopen_fd);
  read_data_bit_rate(section, plan);
  if (const YAML::Node form = section.find("usdo_abort");
      form.IsDefined() && !plan.config.canopen_fd) {
    section.findings().error(place_of(form),
                             "usdo_abort needs canopen_fd: true: only CANopen FD has USDO");
  }
  section.read("emcy_fd", plan.config.emcy_fd);
  if (plan.config.emcy_fd && !plan.config.canopen_fd) {
    section.findings().error(place_of(section.find("emcy_fd")),
                             "emcy_fd needs canopen_fd: true: only CANopen FD has longer EMCYs");
  }
  section.read_choice<usdo::AbortForm>(
      "usdo_abort", plan.config.usdo_abort,
      {{"one-byte", usdo::AbortForm::one_byte}, {"four-bytes", usdo::AbortForm::four_bytes}});
}

}  // namespace linegate::config
