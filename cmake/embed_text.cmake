# Writes a text file as a C array: cmake -DINPUT=a.yaml -DOUTPUT=a.c -DNAME=symbol -P embed_text.cmake
file(READ ${INPUT} digits HEX)
string(REGEX REPLACE "([0-9a-f][0-9a-f])" "0x\\1, " bytes "${digits}")
string(REGEX REPLACE "(0x0a, )" "\\1\n  " bytes "${bytes}")
file(WRITE ${OUTPUT} "/* Written by embed_text.cmake. */
#include <stddef.h>

extern const char ${NAME}[];
extern const size_t ${NAME}_size;

const char ${NAME}[] = {
  ${bytes}0};
const size_t ${NAME}_size = sizeof ${NAME} - 1;
")
