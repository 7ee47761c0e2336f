# Vega, the library that draws the charts of the pages, as one script: ${MBTFM_VEGA_BUNDLE}.
#
# Debian's libjs-vega holds its modules, not the whole. Each expects `require` of CommonJS; those that draw and hold data
# are put together here, without maps of the earth, networks and clouds of words.
find_path(VEGA_FOLDER vega-view.min.js PATHS /usr/share/javascript/vega REQUIRED NO_DEFAULT_PATH)
find_file(VEGA_LICENCE copyright PATHS /usr/share/doc/libjs-vega REQUIRED NO_DEFAULT_PATH)
set(MBTFM_VEGA_BUNDLE ${CMAKE_BINARY_DIR}/generated/vega.js)

set(modules util time format loader dataflow scale canvas scenegraph statistics expression selection event-selector
            functions runtime encode transforms view-transforms view parser)
file(READ ${VEGA_LICENCE} licence)
string(REPLACE "*/" "* /" licence "${licence}")
set(bundle "/*\n${licence}*/\nvar vega=(function(){\"use strict\";var modules={};\nfunction require(name){return modules[name]}\n")
foreach(module ${modules})
  file(READ ${VEGA_FOLDER}/vega-${module}.min.js code)
  string(REGEX REPLACE "//# sourceMappingURL=[^\n]*" "" code "${code}")
  # vega-functions knows its neighbour by another name than its file has
  string(REPLACE "require(\"vega-selections\")" "require(\"vega-selection\")" code "${code}")
  string(APPEND bundle "(function(exports,module){${code}})(modules[\"vega-${module}\"]={},0);\n")
endforeach()
string(APPEND bundle
  "Object.assign(modules[\"vega-dataflow\"].transforms,modules[\"vega-transforms\"],modules[\"vega-view-transforms\"],modules[\"vega-encode\"]);\n"
  "return{parse:modules[\"vega-parser\"].parse,View:modules[\"vega-view\"].View}})();\n")
file(WRITE ${MBTFM_VEGA_BUNDLE}.new "${bundle}")
file(COPY_FILE ${MBTFM_VEGA_BUNDLE}.new ${MBTFM_VEGA_BUNDLE} ONLY_IF_DIFFERENT)
