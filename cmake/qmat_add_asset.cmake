# SPDX-License-Identifier: GPL-3.0-or-later
# Makes an asset as part of a build:
#
#   qmat_add_asset(TARGET name INPUT model.off OUTPUT asset.glb [GRAPH graph.yaml] [SIDE_OUTPUTS asset.bin ...]
#                  [SET name=value ...] [INPUT_NAME model] [OUTPUT_NAME asset] [OPTIONS option ...])
#
# `qmat run GRAPH` makes OUTPUT when it is missing, or when the graph, the model, a file that the model refers to, or qmat
# itself has changed. GRAPH is a file, or the name of a built-in graph; default qmat_plus. A file of that name counts
# first. The ending of OUTPUT chooses the format. A relative OUTPUT is in the current build folder; other relative paths
# are in the current source folder. TARGET is the target that needs the asset; a new one is made and built by default.
# SIDE_OUTPUTS are the files that the asset refers to, beside OUTPUT, as the .bin of a .gltf: other rules may depend on
# them, the target clean deletes them, and Ninja makes the asset anew where one is missing. A file that OPTIONS saves, as
# --output=report=FILE does, has to be one of them. Outputs with a path in the graph are not saved there: all assets of
# one graph would write the same file, into the sources. INPUT_NAME is the graph's input that takes the model.
# OUTPUT_NAME is the output to save; it may be left out if there is only one. ${qmat_GRAPH} is the file of qmat_plus.
function(qmat_add_asset)
  cmake_parse_arguments(PARSE_ARGV 0 asset "" "TARGET;GRAPH;INPUT;OUTPUT;INPUT_NAME;OUTPUT_NAME"
    "SET;OPTIONS;SIDE_OUTPUTS")
  foreach(name TARGET INPUT OUTPUT)
    if(NOT asset_${name})
      message(FATAL_ERROR "qmat_add_asset: ${name} is missing")
    endif()
  endforeach()
  if(asset_UNPARSED_ARGUMENTS)
    message(FATAL_ERROR "qmat_add_asset: unknown argument '${asset_UNPARSED_ARGUMENTS}'")
  endif()
  if(NOT asset_GRAPH)
    set(asset_GRAPH qmat_plus)
  endif()
  set(graph_file)
  cmake_path(ABSOLUTE_PATH asset_GRAPH BASE_DIRECTORY ${CMAKE_CURRENT_SOURCE_DIR} NORMALIZE OUTPUT_VARIABLE path)
  if(NOT asset_GRAPH MATCHES "^[a-z_]+$" OR (EXISTS ${path} AND NOT IS_DIRECTORY ${path}))
    set(asset_GRAPH ${path})
    set(graph_file ${path})
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
  set(sides)
  foreach(side IN LISTS asset_SIDE_OUTPUTS)
    cmake_path(ABSOLUTE_PATH side BASE_DIRECTORY ${folder} NORMALIZE)
    list(APPEND sides ${side})
  endforeach()
  if(sides)
    list(PREPEND sides BYPRODUCTS)
  endif()
  add_custom_command(OUTPUT ${asset_OUTPUT} ${sides}
    COMMAND qmat::program run --quiet --set=${asset_INPUT_NAME}=${asset_INPUT} ${asset_SET} --output=${output}
      --no-paths --depfile=${asset_OUTPUT}.d ${asset_OPTIONS} -- ${asset_GRAPH}
    DEPENDS ${graph_file} ${asset_INPUT} $<TARGET_FILE:qmat::program>
    DEPFILE ${asset_OUTPUT}.d
    COMMENT "Making ${file}" VERBATIM)
  cmake_path(RELATIVE_PATH asset_OUTPUT BASE_DIRECTORY ${CMAKE_CURRENT_BINARY_DIR} OUTPUT_VARIABLE path)
  string(MAKE_C_IDENTIFIER "${asset_TARGET}_${path}" asset_target)
  if(TARGET ${asset_target}) # a-b and a_b
    string(SHA256 digest ${asset_OUTPUT})
    string(SUBSTRING ${digest} 0 8 digest)
    string(APPEND asset_target _${digest})
  endif()
  add_custom_target(${asset_target} DEPENDS ${asset_OUTPUT})
  if(NOT TARGET ${asset_TARGET})
    add_custom_target(${asset_TARGET} ALL)
  endif()
  add_dependencies(${asset_TARGET} ${asset_target})
endfunction()
