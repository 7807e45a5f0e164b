// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <charconv>
#include <limits>

#include "stack/eds/text.h"
#include "stack/eds/value.h"

namespace linegate::eds {
namespace {

Number failure(std::string problem) {
  Number number;
  number.problem = std::move(problem);
  return number;
}

int read_base(std::string_view& digits) {
  if (digits.starts_with("0x") || digits.starts_with("0X")) {
    digits.remove_prefix(2);
    return 16;
  }
  const bool leading_zero = digits.size() > 1 && digits.front() == '0';
  return leading_zero && digits.find_first_of("89") == std::string_view::npos ? 8 : 10;
}

std::string remark_on(std::string_view text, std::string_view digits, const Number& number,
                      int base) {
  if (number.magnitude == 0 || digits.size() < 2 || digits.front() != '0' || base == 16) {
    return {};
  }
  return quote(text) + " begins with 0, which means octal" +
         (base == 8 ? "; read as " : ", but it is decimal; read as ") +
         std::to_string(number.magnitude);
}

}  // namespace

Number parse_number(std::string_view text) {
  Number number;
  std::string_view digits = text;
  if (digits.starts_with('-') || digits.starts_with('+')) {
    number.negative = digits.front() == '-';
    digits.remove_prefix(1);
  }
  const int base = read_base(digits);
  number.hexadecimal = base == 16;
  const char* end = digits.data() + digits.size();
  const auto [stop, error] = std::from_chars(digits.data(), end, number.magnitude, base);
  if (error == std::errc::result_out_of_range) {
    return failure(quote(text) + " has more than 64 bits");
  }
  if (error != std::errc() || stop != end) {
    return failure(quote(text) + " is not a number");
  }
  number.remark = remark_on(text, digits, number, base);
  return number;
}

Number parse_formula(std::string_view text, std::uint8_t node_id) {
  if (text.find('$') == std::string_view::npos) {
    return parse_number(text);
  }
  Number sum;
  for (std::string_view rest = text;;) {
    const std::size_t plus = std::min(rest.find('+'), rest.size());
    const std::string_view term = trim(rest.substr(0, plus));
    Number addend;
    if (equal_ignoring_case(term, "$NODEID")) {
      addend.magnitude = node_id;
      sum.uses_node_id = true;
    } else {
      addend = parse_number(term);
    }
    if (!addend.ok() || addend.negative) {
      return failure(quote(text) + " is not a formula like $NODEID+0x180");
    }
    if (addend.magnitude > std::numeric_limits<std::uint64_t>::max() - sum.magnitude) {
      return failure(quote(text) + " has more than 64 bits");
    }
    sum.magnitude += addend.magnitude;
    sum.remark += addend.remark;
    sum.hexadecimal = sum.hexadecimal || addend.hexadecimal;
    if (plus == rest.size()) {
      return sum;
    }
    rest.remove_prefix(plus + 1);
  }
}

}  // namespace linegate::eds
