# Writes a header with the files of the peer, which the command compiles where it runs.
#   cmake -DOUTPUT=peer_files.inc "-DFILES=a.h;b.cpp" -P embed.cmake
set(text "struct PeerFile {\n  const char *name, *text;\n};\ninline constexpr PeerFile kPeerFiles[] = {\n")
foreach(file IN LISTS FILES)
  file(READ ${file} content)
  get_filename_component(name ${file} NAME)
  string(APPEND text "{\"${name}\", R\"peer(${content})peer\"},\n")
endforeach()
file(WRITE ${OUTPUT} "${text}};\n")
