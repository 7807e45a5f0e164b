// SPDX-License-Identifier: Apache-2.0
#include "bridges/dds/type_description.h"

#include <fastrtps/types/DynamicTypeBuilder.h>
#include <fastrtps/types/DynamicTypeBuilderFactory.h>
#include <fastrtps/types/DynamicTypeBuilderPtr.h>
#include <fastrtps/types/TypeObjectFactory.h>

namespace linegate::dds {
namespace {

namespace types = eprosima::fastrtps::types;

types::DynamicType_ptr type_of(const named::DescribedMember& member) {
  auto* const factory = types::DynamicTypeBuilderFactory::get_instance();
  switch (member.form) {
    case named::Form::boolean:
      return factory->create_bool_type();
    case named::Form::int8:  // Fast DDS 2.9 has no such kind
    case named::Form::uint8:
      return factory->create_byte_type();
    case named::Form::int16:
      return factory->create_int16_type();
    case named::Form::uint16:
      return factory->create_uint16_type();
    case named::Form::int32:
      return factory->create_int32_type();
    case named::Form::uint32:
      return factory->create_uint32_type();
    case named::Form::int64:
      return factory->create_int64_type();
    case named::Form::uint64:
      return factory->create_uint64_type();
    case named::Form::float32:
      return factory->create_float32_type();
    case named::Form::float64:
      return factory->create_float64_type();
    case named::Form::text:
      return factory->create_string_type(member.length);
    case named::Form::octets: {
      const types::DynamicTypeBuilder_ptr array(
          factory->create_array_builder(factory->create_byte_type(), {member.length}));
      return array->build();
    }
  }
  return {};
}

}  // namespace

bool describe_type(const std::string& name, const std::vector<named::DescribedMember>& members) {
  auto* const factory = types::DynamicTypeBuilderFactory::get_instance();
  if (types::TypeObjectFactory::get_instance()->get_type_object(name, true) != nullptr)
    return true;  // the name has a hash of the members
  const types::DynamicTypeBuilder_ptr builder(factory->create_struct_builder());
  builder->set_name(name);
  types::MemberId id = 0;
  for (const named::DescribedMember& member : members) {
    if (builder->add_member(id++, member.name, type_of(member)) != types::ReturnCode_t::RETCODE_OK)
      return false;
  }
  const types::DynamicType_ptr type = builder->build();
  if (!type)
    return false;
  types::TypeObject complete;
  types::TypeObject minimal;
  factory->build_type_object(type, complete, true, true);  // and adds it to TypeObjectFactory
  factory->build_type_object(type, minimal, false, true);
  return types::TypeObjectFactory::get_instance()->get_type_object(name, true) != nullptr;
}

}  // namespace linegate::dds
