# Writes OUTPUT: a C++ table of the FILES (relative to SOURCE) with their texts.
set(text "#include \"schemas/embedded.hpp\"\n\nusing namespace std::string_view_literals;\n\nnamespace slew {\n\nstd::span<const EmbeddedFile> embedded_files() {\n  static constexpr EmbeddedFile files[] = {\n")
foreach(file ${FILES})
  file(READ ${SOURCE}/${file} content)
  # Compilers bound the length of one literal; adjacent ones are joined. The suffix tells the length, which clang
  # would not count to the end.
  string(LENGTH "${content}" length)
  set(literals "")
  set(begin 0)
  while(begin LESS length)
    string(SUBSTRING "${content}" ${begin} 8000 piece)
    string(APPEND literals "R\"embedded(${piece})embedded\"\n")
    math(EXPR begin "${begin} + 8000")
  endwhile()
  string(APPEND text "      {\"${file}\", ${literals}\"\"sv},\n")
endforeach()
string(APPEND text "  };\n  return files;\n}\n\n}  // namespace slew\n")
file(WRITE ${OUTPUT} "${text}")
