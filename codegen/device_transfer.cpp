// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/codegen/device_transfer.h>

#include <charconv>
#include <string_view>

#include <dyntape/autodiff/error.h>

namespace dyntape::codegen {
namespace {

std::size_t device_number(const std::string& device) {
  constexpr std::string_view kPrefix = "opencl:";
  std::size_t number = 0;
  const char* const end = device.data() + device.size();
  if (device.starts_with(kPrefix)) {
    const auto [at, error] = std::from_chars(device.data() + kPrefix.size(), end, number);
    if (error == std::errc() && at == end) return number;
  }
  throw ArgumentError("device \"" + device + "\": expected opencl: and a number, as in opencl:0");
}

}  // namespace

OpenClDevice device_of_name(const std::string& name, bool single) {
  OpenClDevice device = opencl_device(device_number(name));
  if (!single && !device.has_doubles)
    throw ArgumentError("device " + name + " (" + device.name +
                        ") has no double precision; expected another device, or single precision");
  return device;
}

std::string options_for(const OpenClDevice& device, bool single) {
  std::string options = "-cl-std=CL1.2 -w";
  if (single && device.divides_exactly) options += " -cl-fp32-correctly-rounded-divide-sqrt";
  return options;
}

}  // namespace dyntape::codegen
