// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/codegen/device/opencl.h>

#include <algorithm>
#include <mutex>
#include <optional>

#include <dyntape/autodiff/error.h>
#include <dyntape/codegen/device/opencl_api.h>
#include <dyntape/codegen/print/print_tables.h>
#include <dyntape/codegen/store/cache.h>

namespace dyntape::codegen {
namespace {

using opencl::Api;
using opencl::api;
using opencl::Int;

constexpr std::size_t kLongestLog = 2000;  // of a compiler, in a message
constexpr std::size_t kGroup = 64;         // work-items side by side, of processors fewer:
constexpr std::size_t kGroupBytes = 256
                                    << 10;  // their drivers have the memory of a group on a thread's stack

[[noreturn]] void fail_on(const OpenClDevice& device, const std::string& what, Int error) {
  const bool is_memory =
      error == opencl::kNoMemory || error == opencl::kOutOfResources || error == opencl::kOutOfHostMemory;
  throw ToolError("OpenCL: " + device.name + " " + what + ": error " + std::to_string(error) +
                  (is_memory ? ", the device has no room; expected fewer states at a time" : ""));
}

void expect(const OpenClDevice& device, Int error, const char* what) {
  if (error != opencl::kSuccess) fail_on(device, what, error);
}

template <class Get>
std::string string_of(Get&& get) {
  std::size_t bytes = 0;
  if (get(std::size_t{0}, static_cast<void*>(nullptr), &bytes) != opencl::kSuccess || bytes == 0) return {};
  std::string text(bytes, '\0');
  if (get(bytes, static_cast<void*>(text.data()), static_cast<std::size_t*>(nullptr)) != opencl::kSuccess)
    return {};
  return text.substr(0, text.find('\0'));
}

template <class T>
T number_of(opencl::Device device, opencl::Uint what) {
  T value = 0;
  return api().get_device_info(device, what, sizeof value, &value, nullptr) == opencl::kSuccess ? value
                                                                                                : T{0};
}

OpenClDevice device_of(opencl::Platform platform, opencl::Device device) {
  const auto text = [&](opencl::Uint what) {
    return string_of([&](auto... room) { return api().get_device_info(device, what, room...); });
  };
  OpenClDevice d;
  d.name = text(opencl::kDeviceName);
  d.platform = string_of(
      [&](auto... room) { return api().get_platform_info(platform, opencl::kPlatformName, room...); });
  d.driver = text(opencl::kDriverVersion);
  d.is_cpu = number_of<opencl::Bits>(device, opencl::kDeviceType) & opencl::kIsCpu;
  d.has_doubles = number_of<opencl::Bits>(device, opencl::kDoubleConfig) != 0;
  d.divides_exactly = number_of<opencl::Bits>(device, opencl::kSingleConfig) & opencl::kDividesExactly;
  d.memory = number_of<std::uint64_t>(device, opencl::kMemoryBytes);
  d.largest_buffer = number_of<std::uint64_t>(device, opencl::kLargestBuffer);
  d.platform_object = platform, d.device_object = device;
  return d;
}

opencl::Device object_of(const OpenClDevice& device) {
  return static_cast<opencl::Device>(device.device_object);
}

}  // namespace

std::vector<OpenClDevice> opencl_devices() {
  const Api& cl = api();
  opencl::Uint n = 0;
  std::vector<OpenClDevice> devices;
  if (cl.get_platforms(0, nullptr, &n) != opencl::kSuccess || n == 0) return devices;
  std::vector<opencl::Platform> platforms(n);
  if (cl.get_platforms(n, platforms.data(), nullptr) != opencl::kSuccess) return devices;
  for (const opencl::Platform platform : platforms) {
    opencl::Uint count = 0;
    if (cl.get_devices(platform, opencl::kAllDevices, 0, nullptr, &count) != opencl::kSuccess) continue;
    std::vector<opencl::Device> found(count);
    if (cl.get_devices(platform, opencl::kAllDevices, count, found.data(), nullptr) != opencl::kSuccess)
      continue;
    for (const opencl::Device device : found) devices.push_back(device_of(platform, device));
  }
  return devices;
}

OpenClDevice opencl_device(std::size_t number) {
  const std::vector<OpenClDevice> devices = opencl_devices();
  if (devices.empty())
    throw ToolError(
        "OpenCL: the loader knows no device; expected a driver of one (Debian: pocl-opencl-icd for the "
        "processor)");
  if (number < devices.size()) return devices[number];
  std::string names;
  for (std::size_t i = 0; i < devices.size(); ++i)
    names += (i ? ", " : "") + std::string("opencl:") + std::to_string(i) + " (" + devices[i].name + ")";
  throw ToolError("OpenCL: there is no device opencl:" + std::to_string(number) + "; expected " + names);
}

struct OpenClProgram::Objects {
  struct Buffer {
    opencl::Memory memory = nullptr;
    std::size_t bytes = 0;
  };

  const Api& cl = api();
  OpenClDevice device;
  opencl::Context context = nullptr;
  opencl::Queue queue = nullptr;
  opencl::Program program = nullptr;
  std::vector<opencl::Kernel> kernels;
  std::vector<std::size_t> groups;  // by kernel
  std::vector<Buffer> buffers;      // by argument, kept between calls
  std::mutex mutex;
  bool was_cached = false;

  explicit Objects(OpenClDevice of) : device(std::move(of)) {}

  ~Objects() {
    for (const Buffer& buffer : buffers) {
      if (buffer.memory) cl.release_memory(buffer.memory);
    }
    for (const opencl::Kernel kernel : kernels) cl.release_kernel(kernel);
    if (program) cl.release_program(program);
    if (queue) cl.release_queue(queue);
    if (context) cl.release_context(context);
  }

  void open() {
    const opencl::Device object = object_of(device);
    const std::intptr_t properties[] = {opencl::kContextPlatform,
                                        reinterpret_cast<std::intptr_t>(device.platform_object), 0};
    Int error = 0;
    context = cl.create_context(properties, 1, &object, nullptr, nullptr, &error);
    expect(device, error, "gives no context");
    queue = cl.create_queue(context, object, 0, &error);
    expect(device, error, "gives no queue");
  }

  Int build(const std::string& options) const {
    const opencl::Device object = object_of(device);
    return cl.build_program(program, 1, &object, options.c_str(), nullptr, nullptr);
  }

  void build_text(const DeviceText& text) {
    const char* words = text.text.c_str();
    const std::size_t length = text.text.size();
    Int error = 0;
    program = cl.create_program(context, 1, &words, &length, &error);
    expect(device, error, "takes no text");
    error = build(text.options);
    if (error == opencl::kSuccess) return;
    const std::string log = string_of([&](auto... room) {
      return cl.get_build_info(program, object_of(device), opencl::kBuildLog, room...);
    });
    throw ToolError("OpenCL: the compiler of " + device.name + " refuses the text of \"" + text.name +
                    "\" (error " + std::to_string(error) + "): " + log.substr(0, kLongestLog));
  }

  // False if the driver does not take it, and then there is no program.
  bool build_binary(const std::string& binary, const std::string& options) {
    const opencl::Device object = object_of(device);
    const std::size_t size = binary.size();
    const auto* bytes = reinterpret_cast<const unsigned char*>(binary.data());
    Int error = 0;
    program = cl.create_program_of_binary(context, 1, &object, &size, &bytes, nullptr, &error);
    if (error == opencl::kSuccess && build(options) == opencl::kSuccess) return true;
    if (program) cl.release_program(program);
    program = nullptr;
    return false;
  }

  // Empty if the driver gives none.
  std::string binary() const {
    std::size_t size = 0;
    if (cl.get_program_info(program, opencl::kBinarySizes, sizeof size, &size, nullptr) != opencl::kSuccess)
      return {};
    std::string bytes(size, '\0');
    char* place = bytes.data();
    const Int error = cl.get_program_info(program, opencl::kBinaries, sizeof place, &place, nullptr);
    return error == opencl::kSuccess ? bytes : std::string();
  }

  Key key(const DeviceText& text) const {
    return make_key("opencl\nplatform " + device.platform + "\ndevice " + device.name + "\ndriver " +
                    device.driver + "\noptions " + text.options + "\ntext " + checksum(text.text));
  }

  void keep(const Cache& cache, const DeviceText& text, bool replace) const {
    const std::string bytes = binary();
    if (bytes.empty()) return;
    try {
      TemporaryFolder folder(cache.folder(), "build-");
      write_file(folder.path() + "/library.so", bytes);
      write_file(folder.path() + "/source.c", text.text);
      Manifest manifest;
      manifest.name = text.name;
      manifest.order = text.order;
      manifest.generator = generator_version();
      manifest.compiler = device.name + ", driver " + device.driver;
      manifest.text_hash = checksum(text.text);
      cache.publish(folder, key(text), manifest, replace);
      cache.sweep_sometimes();
    } catch (const FileError&) {
      // It is made again the next time.
    }
  }

  std::size_t group_of(opencl::Kernel kernel, std::size_t memory) const {
    std::size_t most = 1, group = kGroup;
    const Int error =
        cl.get_kernel_info(kernel, object_of(device), opencl::kLargestGroup, sizeof most, &most, nullptr);
    expect(device, error, "tells no size of groups");
    while (group > 1 && (group > most || (device.is_cpu && group * memory > kGroupBytes))) group /= 2;
    return group;
  }

  void make(const DeviceText& text) {
    open();
    const std::optional<Cache> cache = text.use_cache ? Cache::open(text.cache_folder) : std::nullopt;
    const std::optional<Entry> entry = cache ? cache->find(key(text)) : std::nullopt;
    if (entry) was_cached = build_binary(entry->image, text.options);
    if (!was_cached) {
      build_text(text);
      if (cache) keep(*cache, text, entry.has_value());
    }
    for (const std::string& name : text.kernels) {
      Int error = 0;
      kernels.push_back(cl.create_kernel(program, name.c_str(), &error));
      expect(device, error, ("has no kernel " + name).c_str());
      groups.push_back(
          group_of(kernels.back(), groups.size() < text.memory.size() ? text.memory[groups.size()] : 0));
    }
  }

  // Of at least this size; buffers only grow.
  opencl::Memory buffer(std::size_t place, std::size_t bytes) {
    if (place >= buffers.size()) buffers.resize(place + 1);
    Buffer& buffer = buffers[place];
    if (buffer.bytes >= bytes && buffer.memory) return buffer.memory;
    if (buffer.memory) cl.release_memory(buffer.memory);
    Int error = 0;
    buffer = {nullptr, 0};
    buffer.memory = cl.create_buffer(context, opencl::kReadWrite, bytes, nullptr, &error);
    expect(device, error, ("gives no buffer of " + std::to_string(bytes) + " bytes").c_str());
    buffer.bytes = bytes;
    return buffer.memory;
  }
};

OpenClProgram::OpenClProgram(OpenClDevice device, const DeviceText& text)
    : objects_(std::make_unique<Objects>(std::move(device))) {
  objects_->make(text);
}

OpenClProgram::~OpenClProgram() = default;

const OpenClDevice& OpenClProgram::device() const { return objects_->device; }
bool OpenClProgram::was_cached() const { return objects_->was_cached; }

void OpenClProgram::run(std::size_t kernel, const std::vector<Array>& arrays, std::size_t count) const {
  Objects& o = *objects_;
  const std::scoped_lock lock(o.mutex);
  // Nothing that was begun is still at work on the caller's memory when this ends.
  struct End {
    const Objects& objects;
    ~End() { objects.cl.finish(objects.queue); }
  } const end{o};
  const opencl::Kernel object = o.kernels.at(kernel);
  opencl::Uint place = 0;
  for (const Array& array : arrays) {
    const opencl::Memory memory = o.buffer(place, array.bytes);
    if (array.in)
      expect(o.device, o.cl.write(o.queue, memory, 0, 0, array.bytes, array.in, 0, nullptr, nullptr),
             "takes no input");
    expect(o.device, o.cl.set_argument(object, place++, sizeof memory, &memory), "takes no argument");
  }
  const std::uint64_t states = count;
  expect(o.device, o.cl.set_argument(object, place, sizeof states, &states), "takes no count");
  const std::size_t group = o.groups[kernel], items = (count + group - 1) / group * group;
  expect(o.device, o.cl.run(o.queue, object, 1, nullptr, &items, &group, 0, nullptr, nullptr),
         "does not run");
  for (std::size_t i = 0; i < arrays.size(); ++i) {
    if (!arrays[i].out) continue;
    expect(o.device,
           o.cl.read(o.queue, o.buffers[i].memory, 0, 0, arrays[i].bytes, arrays[i].out, 0, nullptr, nullptr),
           "gives no results");
  }
  expect(o.device, o.cl.finish(o.queue), "does not finish");
}

}  // namespace dyntape::codegen
