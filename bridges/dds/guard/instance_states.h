// SPDX-License-Identifier: Apache-2.0
// The states of the instances of readers (DDS 1.4 2.2.2.5.1.3).
//
// The asserts of Fast DDS 2.9.1 that check them (DataReaderInstance.hpp:105, 200 and 226,
// DataReaderHistory.cpp:822) end the process of a reader
// - if a writer disposes an instance without writers, and then writes it. An instance has no writer
//   after its only one missed its deadline, lost its liveliness or unregistered the instance;
// - if an instance with a weaker owner gets two writers with the greatest ownership strength;
// - if a sample has no instance: a GAP names it while fragments of it are missing, or its instance
//   was given to another key while it waited for an earlier sample;
// - if a sample was taken before it was reported: samples of two writers are in an order that the
//   history cannot sort (sample_times.h).
#pragma once

namespace linegate::dds::guard {

// From now on, in all readers of this process:
// - a disposed instance is also unregistered by its writer, as with the QoS policy
//   autodispose_unregistered_instances;
// - a reader with exclusive ownership ignores what disposes or unregisters its instances. Ownership
//   then ends with the deadline or the liveliness of the writer;
// - the greatest ownership strength is one less;
// - a sample without an instance is dropped, if its topic has keys;
// - the view state of an instance remains NEW (DDS 1.4 2.2.2.5.1.8).
// Returns false if the call of the library cannot be replaced.
bool watch_instance_states();

}  // namespace linegate::dds::guard
