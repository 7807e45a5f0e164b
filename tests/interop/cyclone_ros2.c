// SPDX-License-Identifier: Apache-2.0
/* The topics for ROS 2, read with Cyclone DDS as rmw_cyclonedds reads them: its names of topics and
   types, no key, and the QoS of its subscriptions: the usual one, and transient_local. rosidl
   and idlc made the types from the message package that `linegate idl --ros2` wrote. Compares the
   values with those of named.py. cyclone_ros2 DOMAIN: ends with 0 if all are right within 60 s. */
#include <stdbool.h>
#include <stddef.h>
#include <stdio.h>

#include "linegate_plant/msg/PressEveryInputs26c77fbdaf07453c.h"
#include "linegate_plant/msg/PressEveryOutputs41c5ad8c1defa64f.h"
#include "tests/interop/cyclone.h"
#include "tests/interop/every_value.h"

#define DEPTH 10

typedef linegate_plant_msg_PressEveryInputs26c77fbdaf07453c input_message_t;
typedef linegate_plant_msg_PressEveryOutputs41c5ad8c1defa64f output_message_t;

/* The messages have the same members as the types of named topics, so the same functions compare
   them. */
#define SAME_PLACE(MESSAGE, message_member, TYPE, member)                                 \
  _Static_assert(offsetof(MESSAGE, message_member) == offsetof(TYPE, member) &&           \
                     sizeof(((MESSAGE*)0)->message_member) == sizeof(((TYPE*)0)->member), \
                 "the message has the members of the named type")

_Static_assert(sizeof(input_message_t) == sizeof(inputs_t), "");
_Static_assert(sizeof(output_message_t) == sizeof(outputs_t), "");
SAME_PLACE(input_message_t, received.pdo18, inputs_t, received.pdo18);
SAME_PLACE(input_message_t, valid.domain, inputs_t, valid.Domain);
SAME_PLACE(input_message_t, values.flag, inputs_t, values.Flag);
SAME_PLACE(input_message_t, values.class_value, inputs_t, values.class_);
SAME_PLACE(input_message_t, values.n24v_supply, inputs_t, values.n24V_supply);
SAME_PLACE(input_message_t, values.unicode, inputs_t, values.Unicode);
SAME_PLACE(output_message_t, known.set_domain, outputs_t, known.Set_Domain);
SAME_PLACE(output_message_t, waits.set_domain, outputs_t, waits.Set_Domain);
SAME_PLACE(output_message_t, values.set_real_32_m_s, outputs_t, values.Set_Real_32_m_s);
SAME_PLACE(output_message_t, values.set_domain, outputs_t, values.Set_Domain);

/* name: of the type in DDS, which ROS 2 makes from the package and the message. */
static dds_entity_t subscribe(dds_entity_t participant, dds_topic_descriptor_t type,
                              const char* name, const char* topic,
                              dds_durability_kind_t durability) {
  type.m_typename = name;
  return make_reader(participant, &type, topic, durability, DEPTH);
}

static bool is_matched(dds_entity_t reader) {
  dds_subscription_matched_status_t status;
  return dds_get_subscription_matched_status(reader, &status) == DDS_RETCODE_OK &&
         status.current_count == 1;
}

int main(int argc, char** argv) {
  if (argc != 2)
    return 2;
  const dds_entity_t participant = participant_in_domain(argv[1]);
  const dds_entity_t inputs =
      subscribe(participant, linegate_plant_msg_PressEveryInputs26c77fbdaf07453c_desc,
                "linegate_plant::msg::dds_::PressEveryInputs26c77fbdaf07453c_",
                "rt/plant/press/every/inputs", DDS_DURABILITY_TRANSIENT_LOCAL);
  const dds_entity_t outputs =
      subscribe(participant, linegate_plant_msg_PressEveryOutputs41c5ad8c1defa64f_desc,
                "linegate_plant::msg::dds_::PressEveryOutputs41c5ad8c1defa64f_",
                "rt/plant/press/every/outputs", DDS_DURABILITY_TRANSIENT_LOCAL);
  const dds_entity_t usual =
      subscribe(participant, linegate_plant_msg_PressEveryInputs26c77fbdaf07453c_desc,
                "linegate_plant::msg::dds_::PressEveryInputs26c77fbdaf07453c_",
                "rt/plant/press/every/inputs", DDS_DURABILITY_VOLATILE);
  bool has_inputs = false;
  bool has_outputs = false;
  bool matched = false;
  for (int tenths = 0; tenths < 600 && !(has_inputs && has_outputs && matched); ++tenths) {
    matched = is_matched(usual);
    has_inputs = has_inputs || take_inputs(inputs);
    has_outputs = has_outputs || take_outputs(outputs);
    dds_sleepfor(DDS_MSECS(100));
  }
  EXPECT(has_inputs);
  EXPECT(has_outputs);
  EXPECT(matched);
  printf("%d wrong\n", wrong);
  return wrong == 0 ? 0 : 1;
}
