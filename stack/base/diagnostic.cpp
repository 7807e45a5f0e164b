// SPDX-License-Identifier: Apache-2.0
#include "stack/base/diagnostic.h"

namespace linegate {

std::string to_string(const Diagnostic& diagnostic) {
  std::string out = diagnostic.file;
  if (diagnostic.line != 0) {
    out += ':' + std::to_string(diagnostic.line);
    if (diagnostic.column != 0) {
      out += ':' + std::to_string(diagnostic.column);
    }
  }
  switch (diagnostic.severity) {
    case Severity::note:
      out += ": note: ";
      break;
    case Severity::warning:
      out += ": warning: ";
      break;
    case Severity::error:
      out += ": error: ";
      break;
  }
  return out + diagnostic.text;
}

}  // namespace linegate
