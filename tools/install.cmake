# `tools/install P`, or `cmake --install build --prefix P` of a build with its libraries: headers, libraries, the command, robots, tasks and examples, and a package for
# find_package(dyntape).
include(CMakePackageConfigHelpers)
include(GNUInstallDirs)

set(package_dir ${CMAKE_INSTALL_LIBDIR}/cmake/dyntape)
set(libraries dyntape_options dyntape_native dyntape_common dyntape_autodiff dyntape_dynamics dyntape_precisions dyntape_codegen dyntape_interface
  dyntape_scalars dyntape_cppad dyntape_cppad_drop_in
  dyntape_cppad_ipopt)
install(TARGETS ${libraries} EXPORT dyntape ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR})
# The same in the build folder, and what the Python module needs besides.
export(TARGETS ${libraries} dyntape_warnings dyntape_commands dyntape_command_line FILE ${PROJECT_BINARY_DIR}/dyntape_libraries.cmake)
# All that is installed whatever else is built.
list(FILTER libraries EXCLUDE REGEX "_(options|native|drop_in|ipopt)$")  # nothing to build
add_custom_target(dyntape_libraries DEPENDS dyntape_cli ${libraries})
install(EXPORT dyntape FILE dyntapeTargets.cmake NAMESPACE dyntape:: DESTINATION ${package_dir})
install(TARGETS dyntape_cli RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR})
foreach(program dyntape-bench dyntape-mpi)  # where they are built
  if(TARGET ${program})
    install(TARGETS ${program} RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT programs OPTIONAL)
  endif()
endforeach()
execute_process(COMMAND python3 ${PROJECT_SOURCE_DIR}/tools/public_headers.py
  OUTPUT_VARIABLE headers OUTPUT_STRIP_TRAILING_WHITESPACE COMMAND_ERROR_IS_FATAL ANY)
string(REPLACE "\n" ";" headers "${headers}")
set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS tools/public_headers.txt ${headers})
foreach(header ${headers})
  get_filename_component(folder ${header} DIRECTORY)
  install(FILES ${header} DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/dyntape/${folder})
endforeach()
install(FILES LICENSE DESTINATION ${CMAKE_INSTALL_DOCDIR} RENAME copyright)
# How ROS 2 finds a package, by name.
install(FILES package.xml DESTINATION ${CMAKE_INSTALL_DATADIR}/dyntape)
file(WRITE ${PROJECT_BINARY_DIR}/ament_index/dyntape "")
install(FILES ${PROJECT_BINARY_DIR}/ament_index/dyntape DESTINATION ${CMAKE_INSTALL_DATADIR}/ament_index/resource_index/packages)
install(DIRECTORY config/ DESTINATION ${CMAKE_INSTALL_DATADIR}/dyntape)
install(DIRECTORY examples/ DESTINATION ${CMAKE_INSTALL_DATADIR}/dyntape/examples PATTERN __pycache__ EXCLUDE)

configure_package_config_file(tools/dyntapeConfig.cmake.in ${PROJECT_BINARY_DIR}/dyntapeConfig.cmake
  INSTALL_DESTINATION ${package_dir})
write_basic_package_version_file(${PROJECT_BINARY_DIR}/dyntapeConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/dyntapeConfig.cmake ${PROJECT_BINARY_DIR}/dyntapeConfigVersion.cmake
  DESTINATION ${package_dir})
