// SPDX-License-Identifier: BSD-3-Clause
//
// The part of OpenCL's C interface that dyntape calls, by its published binary interface.  Its loader is opened at run time, so
// dyntape builds and runs without OpenCL.  Internal.
//
//   const opencl::Api& cl = opencl::api();                  ToolError: there is no loader
//   cl.finish(queue);                                       clFinish
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

namespace dyntape::codegen::opencl {

using Int = std::int32_t;
using Uint = std::uint32_t;
using Bits = std::uint64_t;

using Platform = struct PlatformObject*;
using Device = struct DeviceObject*;
using Context = struct ContextObject*;
using Queue = struct QueueObject*;
using Program = struct ProgramObject*;
using Kernel = struct KernelObject*;
using Memory = struct MemoryObject*;

inline constexpr Int kSuccess = 0, kDeviceNotFound = -1, kNoMemory = -4, kOutOfResources = -5,
                     kOutOfHostMemory = -6, kBuildFailure = -11, kNoPlatform = -1001;
inline constexpr Bits kAllDevices = 0xffffffff, kIsCpu = 1 << 1;
inline constexpr Bits kReadWrite = 1 << 0, kDividesExactly = 1 << 7;
inline constexpr Uint kPlatformName = 0x0902, kDeviceType = 0x1000, kLargestBuffer = 0x1010,
                      kSingleConfig = 0x101b, kMemoryBytes = 0x101f, kDeviceName = 0x102b,
                      kDriverVersion = 0x102d, kDoubleConfig = 0x1032, kBinarySizes = 0x1165,
                      kBinaries = 0x1166, kBuildLog = 0x1183, kLargestGroup = 0x11b0;
inline constexpr std::intptr_t kContextPlatform = 0x1084;

// Name here, name in the library, result, parameters.
#define DYNTAPE_OPENCL_FUNCTIONS(X)                                                                        \
  X(get_platforms, clGetPlatformIDs, Int, (Uint, Platform*, Uint*))                                        \
  X(get_platform_info, clGetPlatformInfo, Int, (Platform, Uint, std::size_t, void*, std::size_t*))         \
  X(get_devices, clGetDeviceIDs, Int, (Platform, Bits, Uint, Device*, Uint*))                              \
  X(get_device_info, clGetDeviceInfo, Int, (Device, Uint, std::size_t, void*, std::size_t*))               \
  X(create_context, clCreateContext, Context,                                                              \
    (const std::intptr_t*, Uint, const Device*, void (*)(const char*, const void*, std::size_t, void*),    \
     void*, Int*))                                                                                         \
  X(release_context, clReleaseContext, Int, (Context))                                                     \
  X(create_queue, clCreateCommandQueue, Queue, (Context, Device, Bits, Int*))                              \
  X(release_queue, clReleaseCommandQueue, Int, (Queue))                                                    \
  X(create_program, clCreateProgramWithSource, Program,                                                    \
    (Context, Uint, const char**, const std::size_t*, Int*))                                               \
  X(create_program_of_binary, clCreateProgramWithBinary, Program,                                          \
    (Context, Uint, const Device*, const std::size_t*, const unsigned char**, Int*, Int*))                 \
  X(build_program, clBuildProgram, Int,                                                                    \
    (Program, Uint, const Device*, const char*, void (*)(Program, void*), void*))                          \
  X(get_program_info, clGetProgramInfo, Int, (Program, Uint, std::size_t, void*, std::size_t*))            \
  X(get_build_info, clGetProgramBuildInfo, Int, (Program, Device, Uint, std::size_t, void*, std::size_t*)) \
  X(release_program, clReleaseProgram, Int, (Program))                                                     \
  X(create_kernel, clCreateKernel, Kernel, (Program, const char*, Int*))                                   \
  X(release_kernel, clReleaseKernel, Int, (Kernel))                                                        \
  X(get_kernel_info, clGetKernelWorkGroupInfo, Int,                                                        \
    (Kernel, Device, Uint, std::size_t, void*, std::size_t*))                                              \
  X(set_argument, clSetKernelArg, Int, (Kernel, Uint, std::size_t, const void*))                           \
  X(create_buffer, clCreateBuffer, Memory, (Context, Bits, std::size_t, void*, Int*))                      \
  X(release_memory, clReleaseMemObject, Int, (Memory))                                                     \
  X(write, clEnqueueWriteBuffer, Int,                                                                      \
    (Queue, Memory, Uint, std::size_t, std::size_t, const void*, Uint, const void*, void*))                \
  X(read, clEnqueueReadBuffer, Int,                                                                        \
    (Queue, Memory, Uint, std::size_t, std::size_t, void*, Uint, const void*, void*))                      \
  X(run, clEnqueueNDRangeKernel, Int,                                                                      \
    (Queue, Kernel, Uint, const std::size_t*, const std::size_t*, const std::size_t*, Uint, const void*,   \
     void*))                                                                                               \
  X(finish, clFinish, Int, (Queue))

struct Api {
#define DYNTAPE_OPENCL_FUNCTION(name, symbol, result, parameters) result(*name) parameters = nullptr;
  DYNTAPE_OPENCL_FUNCTIONS(DYNTAPE_OPENCL_FUNCTION)
#undef DYNTAPE_OPENCL_FUNCTION
};

// Opens the loader of this name.  ToolError if it is not there or lacks a function.
Api load(const std::string& library);

// The loader of this process, opened once: $DYNTAPE_OPENCL, or libOpenCL.so.1.
const Api& api();

}  // namespace dyntape::codegen::opencl
