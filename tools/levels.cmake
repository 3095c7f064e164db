# One library for every processor: sources that are compiled for several levels, one of which is chosen when the program is
# loaded (tools/levels.sh, autodiff/processor_level.h).
#
#   dyntape_compile_for_levels(dyntape_dynamics UNITS ${units} LIBRARIES dyntape_common)
#   dyntape_compile_for_levels(dyntape_scalars UNITS ${both} OF_v3 ${narrow} OF_v4 ${wide} LIBRARIES ...)
#
# UNITS are compiled for all levels, OF_<level> for that one besides.  Where dyntape is built for one processor (DYNTAPE_ARCH),
# the target takes UNITS as they are.
set(DYNTAPE_LEVELS)
if(DYNTAPE_ARCH STREQUAL every AND CMAKE_SYSTEM_PROCESSOR MATCHES "x86_64|AMD64")
  set(DYNTAPE_LEVELS v2 v3 v4)
endif()

function(dyntape_compile_for_levels target)
  cmake_parse_arguments(PARSE_ARGV 1 arg "" "" "UNITS;OF_v3;OF_v4;LIBRARIES")
  if(NOT DYNTAPE_LEVELS)
    target_sources(${target} PRIVATE ${arg_UNITS})
    return()
  endif()
  set(folder ${CMAKE_CURRENT_BINARY_DIR}/levels_of_${target})
  set(objects)
  set(made)
  foreach(level ${DYNTAPE_LEVELS})
    set(of_level ${target}_${level})
    set(flags)
    dyntape_processor_flags(flags x86-64-${level})
    add_library(${of_level} OBJECT ${arg_UNITS} ${arg_OF_${level}})
    # Statics of templates would be one in the program by force, and so of one level.
    target_compile_options(${of_level} PRIVATE ${flags} $<$<CXX_COMPILER_ID:GNU>:-fno-gnu-unique>)
    target_compile_definitions(${of_level} PRIVATE DYNTAPE_LEVEL=${level})
    target_link_libraries(${of_level} PRIVATE ${arg_LIBRARIES} dyntape_warnings)
    set_property(TARGET ${of_level} PROPERTY UNITY_BUILD OFF)
    file(GENERATE OUTPUT ${folder}/${level}.txt CONTENT "\"$<JOIN:$<TARGET_OBJECTS:${of_level}>,\"\n\">\"\n")
    list(APPEND objects $<TARGET_OBJECTS:${of_level}>)
    list(APPEND made ${folder}/${level}.o)
  endforeach()
  list(APPEND made ${folder}/choose.o)
  add_custom_command(OUTPUT ${made} DEPENDS ${objects} ${PROJECT_SOURCE_DIR}/tools/levels.sh COMMAND_EXPAND_LISTS VERBATIM
    COMMAND ${PROJECT_SOURCE_DIR}/tools/levels.sh ${folder} ${CMAKE_CXX_COMPILER} ${DYNTAPE_LEVELS}
    COMMENT "Joining the levels of ${target}")
  set_source_files_properties(${made} PROPERTIES EXTERNAL_OBJECT ON GENERATED ON)
  target_sources(${target} PRIVATE ${made})
endfunction()
