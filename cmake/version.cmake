# cmake -DSOURCE=FOLDER -DRELEASE=1.2.3 -DOUT=FILE.cpp -P version.cmake: which code this is, as the definition of mbtfm::kVersion.
#
#   0.2.0                         the release: its tag v0.2.0
#   0.2.0-15-g1f2e3d4c5b6a        15 commits after that tag (git describe); 0.2.0-g1f2e3d4c5b6a if there is no tag
#   …-dirty.9a8b7c6d5e4f          with changes that are in no commit: a hash of the sources
#   0.2.0-src.9a8b7c6d5e4f        no repository, as in a tarball: the same hash
#
# Named is the last commit that changed what the programs are made of: one that changes docs or tests alone leaves the version,
# and with it each cell's results, as they are.
cmake_minimum_required(VERSION 3.25)
set(code pipeline segment network substrate mbtfm continuum samples cmake CMakeLists.txt)

function(git out)
  execute_process(COMMAND git --no-optional-locks -C ${SOURCE} ${ARGN}
    OUTPUT_VARIABLE text ERROR_QUIET RESULT_VARIABLE result OUTPUT_STRIP_TRAILING_WHITESPACE)
  if(NOT result EQUAL 0)
    set(text "")
  endif()
  set(${out} "${text}" PARENT_SCOPE)
endfunction()

function(hash_of_sources out)
  list(TRANSFORM code PREPEND ${SOURCE}/)
  set(files "")
  foreach(entry ${code})
    if(IS_DIRECTORY ${entry})
      file(GLOB_RECURSE found RELATIVE ${SOURCE} LIST_DIRECTORIES false ${entry}/*)
      list(FILTER found EXCLUDE REGEX "__pycache__|~$")
      list(APPEND files ${found})
    elseif(EXISTS ${entry})
      file(RELATIVE_PATH found ${SOURCE} ${entry})
      list(APPEND files ${found})
    endif()
  endforeach()
  list(SORT files)
  set(hashes "")
  foreach(file ${files})
    file(SHA256 ${SOURCE}/${file} hash)
    string(APPEND hashes "${file} ${hash}\n")
  endforeach()
  string(SHA256 all "${hashes}")
  string(SUBSTRING ${all} 0 12 all)
  set(${out} ${all} PARENT_SCOPE)
endfunction()

git(top rev-parse --show-toplevel)
file(REAL_PATH ${SOURCE} source)
set(version "")
if(top STREQUAL source)  # not a repository around a tarball
  git(version describe --tags --exact-match --match "v[0-9]*" HEAD)
  if(version STREQUAL "")
    git(commit log -1 --format=%H -- ${code})
    git(version describe --tags --abbrev=12 --match "v[0-9]*" ${commit})
  endif()
  if(version STREQUAL "" AND commit)
    string(SUBSTRING ${commit} 0 12 commit)
    set(version ${RELEASE}-g${commit})
  endif()
  string(REGEX REPLACE "^v" "" version "${version}")
  git(changes status --porcelain -- ${code})
endif()
if(version STREQUAL "")
  hash_of_sources(hash)
  set(version ${RELEASE}-src.${hash})
elseif(changes)
  hash_of_sources(hash)
  string(APPEND version -dirty.${hash})
endif()

file(WRITE ${OUT}.new "#include \"pipeline/contract/version.h\"\n\nnamespace mbtfm {\nconst char* const kVersion = \"${version}\";\n}\n")
file(COPY_FILE ${OUT}.new ${OUT} ONLY_IF_DIFFERENT)
