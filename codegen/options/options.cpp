// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/codegen/options/options.h>

namespace dyntape {

const char* to_string(Functions functions) {
  constexpr const char* kNames[] = {"sines", "libm", "portable"};
  return kNames[static_cast<int>(functions)];
}

const char* to_string(Route route) {
  constexpr const char* kNames[] = {"automatic", "interpreter", "machine code", "compiled", "tiered"};
  return kNames[static_cast<int>(route)];
}

const char* to_string(Tier tier) {
  constexpr const char* kNames[] = {"interpreted", "machine code", "compiled at -O1", "compiled"};
  return kNames[static_cast<int>(tier)];
}

Functions functions_from(const std::string& word) {
  for (const Functions functions : {Functions::kSines, Functions::kLibm, Functions::kPortable}) {
    if (word == to_string(functions)) return functions;
  }
  throw ArgumentError("functions \"" + word + "\" do not exist; there are sines, libm and portable");
}

Order order_from(int number) {
  if (number < 0 || number > 2) {
    throw ArgumentError("order " + std::to_string(number) +
                        " does not exist; there are 0 (values), 1 (Jacobian) and 2 (Hessian)");
  }
  return static_cast<Order>(number);
}

}  // namespace dyntape
