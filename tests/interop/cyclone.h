// SPDX-License-Identifier: Apache-2.0
/* Reading and writing Linegate's topics with Cyclone DDS, with the QoS of idl/README.md. If an
   entity cannot be created, the program exits with 2. */
#ifndef LINEGATE_TESTS_INTEROP_CYCLONE_H
#define LINEGATE_TESTS_INTEROP_CYCLONE_H

#include <dds/dds.h>

#include "linegate.h"

/* Returns the entity, or prints `what` and the error, and exits. */
dds_entity_t die_if_failed(dds_entity_t entity, const char* what);

/* domain: the domain ID as text. */
dds_entity_t participant_in_domain(const char* domain);

/* Reliable. The caller deletes it. */
dds_qos_t* reliable_qos(dds_durability_kind_t durability, dds_history_kind_t history, int depth);

dds_entity_t make_topic(dds_entity_t participant, const dds_topic_descriptor_t* type,
                        const char* name);

/* Keeps the last `depth` samples of each instance. */
dds_entity_t make_reader(dds_entity_t participant, const dds_topic_descriptor_t* type,
                         const char* name, dds_durability_kind_t durability, int depth);

#endif
