// SPDX-License-Identifier: BSD-3-Clause
//
// Devices of OpenCL, and programs that run on them.  DeviceFunction (device_function.h) evaluates functions with them.
//
//   for (const OpenClDevice& d : opencl_devices()) std::cout << d.name << "\n";
//   OpenClProgram program(opencl_device(0), {.text = text, .kernels = {"arm_value"}});
//   program.run(0, {{.in = x, .bytes = 8 * n}, {.out = y, .bytes = 8 * m}}, count);
//
// ToolError: there is no loader, no device (of this number; the message lists those that are there), no memory on the
// device, or the device's compiler fails; the message has the beginning of its log.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace dyntape::codegen {

struct OpenClDevice {
  std::string name, platform, driver;  // driver: its version
  bool is_cpu = false;
  bool has_doubles = false;
  bool divides_exactly = false;                  // floats
  std::uint64_t memory = 0, largest_buffer = 0;  // bytes
  void *platform_object = nullptr, *device_object = nullptr;
};

// All devices of all drivers, in the order of the loader.  Empty if there is none; ToolError if there is no loader.
std::vector<OpenClDevice> opencl_devices();
OpenClDevice opencl_device(std::size_t number);

struct DeviceText {
  std::string text = {};
  std::vector<std::string> kernels = {};  // names of its kernels
  std::string options = {};               // of the device's compiler
  std::string name = {};                  // a label in the cache
  int order = 0;
  std::vector<std::size_t> memory = {};  // bytes of a state's own memory, by kernel; empty: little
  // The device's program is kept in the cache, by device, driver and text.  cache_folder: if empty, the usual one.
  bool use_cache = true;
  std::string cache_folder = {};
};

class OpenClProgram {
 public:
  // An array of the kernel: sent before it runs, or fetched afterwards; neither: only made.
  struct Array {
    const void* in = nullptr;
    void* out = nullptr;
    std::size_t bytes = 0;
  };

  OpenClProgram(OpenClDevice device, const DeviceText& text);
  ~OpenClProgram();
  OpenClProgram(const OpenClProgram&) = delete;
  OpenClProgram& operator=(const OpenClProgram&) = delete;

  // Runs a kernel with one work-item a state; its last argument is the count.  One call at a time; others wait.
  void run(std::size_t kernel, const std::vector<Array>& arrays, std::size_t count) const;

  const OpenClDevice& device() const;
  bool was_cached() const;

 private:
  struct Objects;
  std::unique_ptr<Objects> objects_;
};

}  // namespace dyntape::codegen
