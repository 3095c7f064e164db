# Joins the page with its scripts and writes it as a string of C++:
#   cmake -DFOLDER=interface/player -DOUTPUT=page_template.cpp -P embed.cmake
file(READ "${FOLDER}/player.html.in" text)
foreach(script GEOMETRY PLAYER)
  string(TOLOWER ${script} name)
  file(READ "${FOLDER}/${name}.js" lines)
  string(REPLACE "@${script}@\n" "${lines}" text "${text}")
endforeach()
file(WRITE "${OUTPUT}" "// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/report/player/page_template.h>

namespace dyntape {

const char* const kPlayerPage = R\"dyntape_page(${text})dyntape_page\";

}  // namespace dyntape
")
