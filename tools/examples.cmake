# The examples of an installed dyntape as a project of their own: this is share/dyntape/examples/CMakeLists.txt there.
#
#   cmake -S share/dyntape/examples -B build -DCMAKE_PREFIX_PATH=$PWD && cmake --build build
#   build/first share/dyntape/robots/panda.urdf
cmake_minimum_required(VERSION 3.25)
project(dyntape_examples LANGUAGES CXX)
find_package(dyntape REQUIRED)
file(GLOB sources ${CMAKE_CURRENT_SOURCE_DIR}/*.cpp)
foreach(source IN LISTS sources)
  get_filename_component(name ${source} NAME_WE)
  add_executable(${name} ${source})
  target_link_libraries(${name} PRIVATE dyntape::dyntape_interface)
endforeach()
