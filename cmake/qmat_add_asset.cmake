# SPDX-License-Identifier: GPL-3.0-or-later
# Makes an asset as part of a build:
#
#   qmat_add_asset(TARGET name GRAPH graph.yaml INPUT model.off OUTPUT asset.glb
#                  [SET name=value ...] [INPUT_NAME model] [OUTPUT_NAME asset] [OPTIONS option ...])
#
# `qmat run GRAPH` makes OUTPUT when it is missing, or when the graph, the model, a file that the model refers to, or qmat
# itself has changed. GRAPH is a file, or the name of a built-in graph, as qmat_plus. The ending of OUTPUT chooses the
# format. A relative OUTPUT is in the current build folder; other relative paths are in the current source folder. TARGET
# is the target that needs the asset; a new one is made and built by default. INPUT_NAME is the graph's input that takes
# the model. OUTPUT_NAME is the output to save; it may be left out if there is only one. ${qmat_GRAPH} is the file of
# qmat_plus.
function(qmat_add_asset)
  cmake_parse_arguments(PARSE_ARGV 0 asset "" "TARGET;GRAPH;INPUT;OUTPUT;INPUT_NAME;OUTPUT_NAME" "SET;OPTIONS")
  foreach(name TARGET GRAPH INPUT OUTPUT)
    if(NOT asset_${name})
      message(FATAL_ERROR "qmat_add_asset: ${name} is missing")
    endif()
  endforeach()
  if(asset_UNPARSED_ARGUMENTS)
    message(FATAL_ERROR "qmat_add_asset: unknown argument '${asset_UNPARSED_ARGUMENTS}'")
  endif()
  set(graph_file)
  if(NOT asset_GRAPH MATCHES "^[a-z_]+$")
    cmake_path(ABSOLUTE_PATH asset_GRAPH BASE_DIRECTORY ${CMAKE_CURRENT_SOURCE_DIR} NORMALIZE)
    set(graph_file ${asset_GRAPH})
  endif()
  cmake_path(ABSOLUTE_PATH asset_INPUT BASE_DIRECTORY ${CMAKE_CURRENT_SOURCE_DIR} NORMALIZE)
  cmake_path(ABSOLUTE_PATH asset_OUTPUT BASE_DIRECTORY ${CMAKE_CURRENT_BINARY_DIR} NORMALIZE)
  if(NOT asset_INPUT_NAME)
    set(asset_INPUT_NAME model)
  endif()
  set(output ${asset_OUTPUT})
  if(asset_OUTPUT_NAME)
    set(output ${asset_OUTPUT_NAME}=${asset_OUTPUT})
  endif()
  list(TRANSFORM asset_SET PREPEND "--set=")
  cmake_path(GET asset_OUTPUT PARENT_PATH folder)
  cmake_path(GET asset_OUTPUT FILENAME file)
  file(MAKE_DIRECTORY ${folder})
  add_custom_command(OUTPUT ${asset_OUTPUT}
    COMMAND qmat::program run --quiet --set=${asset_INPUT_NAME}=${asset_INPUT} ${asset_SET} --output=${output}
      --depfile=${asset_OUTPUT}.d ${asset_OPTIONS} -- ${asset_GRAPH}
    DEPENDS ${graph_file} ${asset_INPUT} $<TARGET_FILE:qmat::program>
    DEPFILE ${asset_OUTPUT}.d
    COMMENT "Making ${file}" VERBATIM)
  string(MAKE_C_IDENTIFIER "${asset_TARGET}_${file}" asset_target)
  add_custom_target(${asset_target} DEPENDS ${asset_OUTPUT})
  if(NOT TARGET ${asset_TARGET})
    add_custom_target(${asset_TARGET} ALL)
  endif()
  add_dependencies(${asset_TARGET} ${asset_target})
endfunction()
