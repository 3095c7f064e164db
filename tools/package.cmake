# `cpack -G DEB` in the build folder, or `tools/package deb`: what `cmake --install` gives except the programs for measuring and for MPI, and the
# Python package where it is built.  What the programs are linked with is found by dpkg-shlibdeps.
set(CPACK_PACKAGE_CONTACT "The dyntape authors")
set(CPACK_PACKAGE_DESCRIPTION "Exact derivatives of robot dynamics as machine code, for simulation and optimal control: the command dyntape, \
libraries and headers for C++, and a module for Python.")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_INSTALL_CMAKE_PROJECTS "${PROJECT_BINARY_DIR};${PROJECT_NAME};Unspecified;/")
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_COMPRESSION_TYPE zstd)
set(CPACK_DEBIAN_PACKAGE_SECTION science)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
if(CMAKE_CROSSCOMPILING)
  set(CPACK_DEBIAN_PACKAGE_ARCHITECTURE arm64)
  set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS_PRIVATE_DIRS ${CMAKE_SYSROOT}/lib/aarch64-linux-gnu ${CMAKE_SYSROOT}/usr/lib/aarch64-linux-gnu ${CMAKE_SYSROOT}/usr/lib)
endif()
set(CPACK_DEBIAN_PACKAGE_DEPENDS gnuplot-nox)  # draws pictures
set(CPACK_DEBIAN_PACKAGE_RECOMMENDS "gcc, libc6-dev")  # without them functions stay machine code, which needs no compiler
# What the headers include and find_package(dyntape) asks for.
set(suggested g++ cmake pkg-config libeigen3-dev libboost-dev nlohmann-json3-dev liburdfdom-dev libtinyxml2-dev coinor-libipopt-dev libassimp-dev
  libsleef-dev libsundials-dev libxxhash-dev)
if(NOT CMAKE_CROSSCOMPILING)
  list(APPEND suggested libxbyak-dev)
endif()
if(DYNTAPE_SUITESPARSE)
  list(APPEND suggested libsuitesparse-dev)
endif()
list(JOIN suggested ", " CPACK_DEBIAN_PACKAGE_SUGGESTS)
if(DYNTAPE_PYTHON)
  list(APPEND CPACK_INSTALL_CMAKE_PROJECTS "${PROJECT_BINARY_DIR};${PROJECT_NAME};python;/")
  find_package(Python REQUIRED COMPONENTS Interpreter)
  math(EXPR next "${Python_VERSION_MINOR} + 1")
  string(APPEND CPACK_DEBIAN_PACKAGE_DEPENDS ", python3 (>= 3.${Python_VERSION_MINOR}), python3 (<< 3.${next}), python3-numpy")
endif()
include(CPack)
