# Writes a header with the texts of files as constants.
#   cmake -DOUTPUT=texts.inc "-DNAMES=kOne;kTwo" "-DFILES=one.h;two.h" -P embed_text.cmake
set(text "")
foreach(name file IN ZIP_LISTS NAMES FILES)
  file(READ ${file} content)
  string(APPEND text "inline constexpr char ${name}[] = R\"text(${content})text\";\n")
endforeach()
file(WRITE ${OUTPUT} "${text}")
