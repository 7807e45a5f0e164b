// SPDX-License-Identifier: Apache-2.0
#include "tests/interop/cyclone.h"

#include <stdio.h>
#include <stdlib.h>

dds_entity_t die_if_failed(dds_entity_t entity, const char* what) {
  if (entity >= 0)
    return entity;
  printf("%s: %s\n", what, dds_strretcode(-entity));
  exit(2);
}

dds_entity_t participant_in_domain(const char* domain) {
  return die_if_failed(
      dds_create_participant((dds_domainid_t)strtoul(domain, NULL, 10), NULL, NULL), "participant");
}

dds_qos_t* reliable_qos(dds_durability_kind_t durability, dds_history_kind_t history, int depth) {
  dds_qos_t* q = dds_create_qos();
  dds_qset_reliability(q, DDS_RELIABILITY_RELIABLE, DDS_MSECS(500));
  dds_qset_durability(q, durability);
  dds_qset_history(q, history, depth);
  return q;
}

dds_entity_t make_topic(dds_entity_t participant, const dds_topic_descriptor_t* type,
                        const char* name) {
  return die_if_failed(dds_create_topic(participant, type, name, NULL, NULL), name);
}

dds_entity_t make_reader(dds_entity_t participant, const dds_topic_descriptor_t* type,
                         const char* name, dds_durability_kind_t durability, int depth) {
  dds_qos_t* q = reliable_qos(durability, DDS_HISTORY_KEEP_LAST, depth);
  const dds_entity_t made =
      dds_create_reader(participant, make_topic(participant, type, name), q, NULL);
  dds_delete_qos(q);
  return die_if_failed(made, name);
}
