# Toolchain of `cmake --preset aarch64`: Debian's cross compiler, and the arm64 packages that `tools/setup --aarch64` unpacks.  Programs that are
# made, tests among them, run under qemu-aarch64.  For another system, -DDYNTAPE_SYSROOT=FOLDER with a preset of your own.
set(CMAKE_SYSTEM_NAME Linux)
set(CMAKE_SYSTEM_PROCESSOR aarch64)
set(DYNTAPE_SYSROOT ${CMAKE_CURRENT_LIST_DIR}/../build/aarch64/sysroot CACHE PATH "Root folder of an arm64 Debian 12")
list(APPEND CMAKE_TRY_COMPILE_PLATFORM_VARIABLES DYNTAPE_SYSROOT)
get_filename_component(CMAKE_SYSROOT ${DYNTAPE_SYSROOT} ABSOLUTE)
if(NOT EXISTS ${CMAKE_SYSROOT}/usr/lib/aarch64-linux-gnu)
  message(FATAL_ERROR "${CMAKE_SYSROOT} is no root folder of arm64; `tools/setup --aarch64` makes one")
endif()

set(CMAKE_C_COMPILER aarch64-linux-gnu-gcc)
set(CMAKE_CXX_COMPILER aarch64-linux-gnu-g++)
set(CMAKE_LIBRARY_ARCHITECTURE aarch64-linux-gnu)
foreach(kind LIBRARY INCLUDE PACKAGE)
  set(CMAKE_FIND_ROOT_PATH_MODE_${kind} ONLY)
endforeach()
set(CMAKE_FIND_ROOT_PATH_MODE_PROGRAM NEVER)
set(ENV{PKG_CONFIG_SYSROOT_DIR} ${CMAKE_SYSROOT})
set(ENV{PKG_CONFIG_LIBDIR} ${CMAKE_SYSROOT}/usr/lib/aarch64-linux-gnu/pkgconfig:${CMAKE_SYSROOT}/usr/lib/pkgconfig:${CMAKE_SYSROOT}/usr/share/pkgconfig)
# The host's compiler wrappers of MPI name the host's libraries.
set(CMAKE_DISABLE_FIND_PACKAGE_MPI ON)
# The arm64 packages' Python, emulated, asked as any other; modules that it needs stand in usr/local/lib/python3.11/dist-packages (tools/package).
set(Python_EXECUTABLE ${CMAKE_SYSROOT}/python CACHE FILEPATH "Python of the processor that is compiled for")
set(Python_INCLUDE_DIR ${CMAKE_SYSROOT}/usr/include/python3.11 CACHE PATH "Its headers")
set(CMAKE_CROSSCOMPILING_EMULATOR ${CMAKE_COMMAND} -E env DYNTAPE_SYSROOT=${CMAKE_SYSROOT} ${CMAKE_CURRENT_LIST_DIR}/aarch64_run)
