// SPDX-License-Identifier: Apache-2.0
/* The values of tests/dds/known_values.h in C. Each function compares a whole sample. */
#ifndef LINEGATE_TESTS_INTEROP_KNOWN_VALUES_H
#define LINEGATE_TESTS_INTEROP_KNOWN_VALUES_H

#include "linegate.h"

void compare_gateway_state(const linegate_v1_GatewayState* sample);
void compare_line_state(const linegate_v1_LineState* sample);
void compare_node_state(const linegate_v1_NodeState* sample);
void compare_output_state(const linegate_v1_OutputState* sample);
void compare_image_layout(const linegate_v1_ImageLayout* sample);
void compare_process_image(const linegate_v1_ProcessImage* sample);
void compare_pdo_update(const linegate_v1_PdoUpdate* sample);
void compare_pdo_reception(const linegate_v1_PdoReception* sample);
void compare_event(const linegate_v1_Event* sample);

/* Data of commands. */
void pattern(uint8_t* data, size_t size, uint8_t seed);

#endif
