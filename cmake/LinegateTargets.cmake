# SPDX-License-Identifier: Apache-2.0
# How a target of this project is made: one language level, one set of warnings, one include root
# (the repository, so that an include names the house: "stack/od/dictionary.h").
include(CMakeParseArguments)

add_library(linegate_flags INTERFACE)
target_compile_features(linegate_flags INTERFACE cxx_std_20)
target_include_directories(linegate_flags INTERFACE
  $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}> $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}/linegate>)

add_library(linegate_warnings INTERFACE)
target_compile_options(linegate_warnings INTERFACE
  -Wall -Wextra -Wpedantic -Wshadow -Wconversion -Wsign-conversion -Wnon-virtual-dtor
  -Woverloaded-virtual -Wcast-align -Wformat=2 -Werror
  # A designated initialiser leaves the members it does not name at their defaults, on purpose.
  -Wno-missing-field-initializers)

if(LINEGATE_SANITIZE)
  string(REPLACE ";" "," _sanitize "${LINEGATE_SANITIZE}")
  add_compile_options(-fsanitize=${_sanitize} -fno-omit-frame-pointer -fno-sanitize-recover=all)
  add_link_options(-fsanitize=${_sanitize})
  if("thread" IN_LIST LINEGATE_SANITIZE)
    add_library(linegate_clock_lock STATIC ${PROJECT_SOURCE_DIR}/tests/tsan/clock_lock.c)
    add_link_options(-Wl,-u,pthread_mutex_clocklock)
    link_libraries($<BUILD_INTERFACE:linegate_clock_lock>)
  endif()
endif()

if(LINEGATE_BUILD_FUZZ)
  enable_testing()
  add_compile_options(-fsanitize=address,undefined -fno-omit-frame-pointer -fno-sanitize-recover=all)
  add_link_options(-fsanitize=address,undefined)
endif()

# The standard library checks what an access to it requires, as an index or an empty optional, of which the sanitizers
# report only some.
if(CMAKE_CXX_COMPILER_ID STREQUAL "Clang" AND (LINEGATE_BUILD_FUZZ OR "undefined" IN_LIST LINEGATE_SANITIZE))
  add_compile_definitions(_GLIBCXX_ASSERTIONS)
endif()

# The headers of the standard library and of GoogleTest are most of what a small file of ours takes to compile: they are
# read once for all targets. A compiler cache does better without.
set(_precompile ON)
if(CMAKE_CXX_COMPILER_LAUNCHER)
  set(_precompile OFF)
endif()
option(LINEGATE_PRECOMPILE_HEADERS "Precompile the headers of the standard library and of GoogleTest" ${_precompile})

set(LINEGATE_STANDARD_HEADERS <algorithm> <array> <bit> <bitset> <charconv> <chrono> <deque> <functional> <map> <memory>
                              <optional> <set> <span> <string> <string_view> <tuple> <utility> <vector>)
set(LINEGATE_FAST_DDS_HEADERS
    <fastdds/dds/domain/DomainParticipantFactory.hpp> <fastdds/dds/domain/DomainParticipant.hpp>
    <fastdds/dds/publisher/DataWriter.hpp> <fastdds/dds/publisher/Publisher.hpp> <fastdds/dds/subscriber/DataReader.hpp>
    <fastdds/dds/subscriber/SampleInfo.hpp> <fastdds/dds/subscriber/Subscriber.hpp> <fastdds/dds/topic/TypeSupport.hpp>)

# linegate_precompile(TARGET [PIC] [GTEST] [FAST_DDS] [option ...]) gives TARGET these headers, of libraries alone: our own files say
# what they need. The options are those that TARGET is compiled with besides those of its folder; targets of equal
# options share the headers.
function(linegate_precompile target)
  if(NOT LINEGATE_PRECOMPILE_HEADERS)
    return()
  endif()
  cmake_parse_arguments(ARG "PIC;GTEST;FAST_DDS" "" "" ${ARGN})
  get_directory_property(of_folder COMPILE_OPTIONS)
  string(MD5 key "${ARG_PIC};${ARG_GTEST};${ARG_FAST_DDS};${of_folder};${ARG_UNPARSED_ARGUMENTS}")
  string(SUBSTRING ${key} 0 8 key)
  set(headers linegate_headers_${key})
  if(NOT TARGET ${headers})
    set(source ${PROJECT_BINARY_DIR}/${headers}.cpp)
    file(CONFIGURE OUTPUT ${source} CONTENT "")
    add_library(${headers} OBJECT ${source})
    target_link_libraries(${headers} PRIVATE linegate_flags linegate_warnings)
    target_compile_options(${headers} PRIVATE ${ARG_UNPARSED_ARGUMENTS})
    set_target_properties(${headers} PROPERTIES CXX_EXTENSIONS OFF POSITION_INDEPENDENT_CODE ${ARG_PIC})
    target_precompile_headers(${headers} PRIVATE ${LINEGATE_STANDARD_HEADERS})
    if(ARG_GTEST)
      target_link_libraries(${headers} PRIVATE GTest::gmock)
      target_precompile_headers(${headers} PRIVATE <gmock/gmock.h> <gtest/gtest.h>)
    endif()
    if(ARG_FAST_DDS)
      target_link_libraries(${headers} PRIVATE fastrtps)
      target_precompile_headers(${headers} PRIVATE ${LINEGATE_FAST_DDS_HEADERS})
    endif()
  endif()
  target_precompile_headers(${target} REUSE_FROM ${headers})
endfunction()

# Under sanitizers, for add_compile_options() of folders whose code takes longer to compile than it
# runs. The stack and what tests run with it for minutes of a plant's time stay optimised.
set(LINEGATE_UNOPTIMISED "")
if(LINEGATE_SANITIZE OR LINEGATE_BUILD_FUZZ)
  set(LINEGATE_UNOPTIMISED -O0)
endif()

# Headers and the templates that each file makes of them take most of the time that a file of ours takes to compile. Eight
# files of a library and not all: a change of one file shall not wait for its whole library, and a large library shall
# occupy more than one processor. WHOLE: all of them, for builds that nobody works with.
set(LINEGATE_UNITY OFF CACHE STRING "Compile sources of libraries and programs eight at a time, those of a test at once")
set_property(CACHE LINEGATE_UNITY PROPERTY STRINGS OFF ON WHOLE)

# Sources that are compiled together have no options of their own.
function(linegate_no_own_options)
  foreach(source IN LISTS ARGN)
    foreach(property COMPILE_DEFINITIONS COMPILE_FLAGS COMPILE_OPTIONS INCLUDE_DIRECTORIES)
      get_source_file_property(value ${PROJECT_SOURCE_DIR}/${source} ${property})
      if(value)
        message(FATAL_ERROR "${source} has ${property}, which are lost where it is compiled with others: give them to its target")
      endif()
    endforeach()
  endforeach()
endfunction()

# linegate_unity(TARGET FILES): so many of its sources are compiled as one; 0: all of them; 1: all of them if WHOLE. Files
# that are generated are compiled by themselves. CMake's UNITY_BUILD includes sources by their absolute names, and a
# compiler cache would find nothing that another clone has compiled.
function(linegate_unity target files)
  if(NOT LINEGATE_UNITY)
    return()
  endif()
  set(own)
  set(others)
  get_target_property(sources ${target} SOURCES)
  foreach(source IN LISTS sources)
    cmake_path(ABSOLUTE_PATH source BASE_DIRECTORY ${CMAKE_CURRENT_SOURCE_DIR} NORMALIZE OUTPUT_VARIABLE path)
    cmake_path(IS_PREFIX PROJECT_SOURCE_DIR ${path} in_repository)
    cmake_path(IS_PREFIX PROJECT_BINARY_DIR ${path} is_generated)
    if(path MATCHES "\\.cpp$" AND in_repository AND NOT is_generated)
      cmake_path(RELATIVE_PATH path BASE_DIRECTORY ${PROJECT_SOURCE_DIR})
      list(APPEND own ${path})
    else()
      list(APPEND others ${source})
    endif()
  endforeach()
  list(LENGTH own count)
  if(files EQUAL 0 OR LINEGATE_UNITY STREQUAL "WHOLE")
    set(files ${count})
  endif()
  if(count LESS 2 OR files EQUAL 1)
    return()
  endif()
  cmake_language(EVAL CODE "cmake_language(DEFER CALL linegate_no_own_options ${own})")
  math(EXPR last "${count} - 1")
  foreach(first RANGE 0 ${last} ${files})
    list(SUBLIST own ${first} ${files} batch)
    list(TRANSFORM batch REPLACE "(.+)" "#include \"\\1\"\n")
    list(JOIN batch "" text)
    set(unit ${CMAKE_CURRENT_BINARY_DIR}/together/${target}_${first}.cpp)
    file(CONFIGURE OUTPUT ${unit} CONTENT "${text}" @ONLY)
    list(APPEND others ${unit})
  endforeach()
  set_property(TARGET ${target} PROPERTY SOURCES ${others})
  # GCC warns of a type in a header, and takes each file that is included for one.
  target_compile_options(${target} PRIVATE $<$<CXX_COMPILER_ID:GNU>:-Wno-subobject-linkage>)
endfunction()

# linegate_library(NAME SOURCES a.cpp ... [HOT] [NO_FUZZER] [FAST_DDS] [OPTIONS ...] [DEPENDS linegate::x ...]
# [PRIVATE_DEPENDS ...]) makes static library linegate_NAME with alias linegate::NAME. HOT: its sources are compiled
# one by one, because what is inlined across files makes the way of a frame longer. NO_FUZZER: no program of
# tests/fuzz links it. FAST_DDS: its sources include headers of Fast DDS. OPTIONS: of the compiler.
function(linegate_library name)
  cmake_parse_arguments(ARG "HOT;NO_FUZZER;FAST_DDS" "" "SOURCES;OPTIONS;DEPENDS;PRIVATE_DEPENDS" ${ARGN})
  if(ARG_SOURCES)
    add_library(linegate_${name} STATIC ${ARG_SOURCES})
    target_link_libraries(linegate_${name} PUBLIC linegate_flags ${ARG_DEPENDS}
                          PRIVATE $<BUILD_INTERFACE:linegate_warnings> ${ARG_PRIVATE_DEPENDS})
    set_target_properties(linegate_${name} PROPERTIES CXX_EXTENSIONS OFF POSITION_INDEPENDENT_CODE ON)
    if(ARG_HOT)
      linegate_unity(linegate_${name} 1)
    else()
      linegate_unity(linegate_${name} 8)
    endif()
    set_target_properties(linegate_${name} PROPERTIES LINEGATE_NO_FUZZER ${ARG_NO_FUZZER})
    set(options ${ARG_OPTIONS})
    if(LINEGATE_BUILD_FUZZ AND NOT ARG_NO_FUZZER)
      # Counts the branches that inputs of a fuzzer reach; tests/fuzz links the fuzzer itself.
      list(APPEND options -fsanitize=fuzzer-no-link)
    endif()
    target_compile_options(linegate_${name} PRIVATE ${options})
    set(fast_dds)
    if(ARG_FAST_DDS AND LINEGATE_UNITY)  # a library that is one file reads them once anyway
      set(fast_dds FAST_DDS)
    endif()
    linegate_precompile(linegate_${name} PIC ${fast_dds} ${options})
  else()
    add_library(linegate_${name} INTERFACE)
    target_link_libraries(linegate_${name} INTERFACE linegate_flags ${ARG_DEPENDS})
  endif()
  set_target_properties(linegate_${name} PROPERTIES EXPORT_NAME ${name})
  add_library(linegate::${name} ALIAS linegate_${name})
endfunction()

# linegate_program(NAME SOURCES ... DEPENDS ...) makes an executable in the build folder's bin, where
# deploy/demo and a person look for it, that is installed to bin.
function(linegate_program name)
  cmake_parse_arguments(ARG "" "" "SOURCES;DEPENDS" ${ARGN})
  add_executable(${name} ${ARG_SOURCES})
  target_link_libraries(${name} PRIVATE linegate_flags linegate_warnings ${ARG_DEPENDS})
  set_target_properties(${name} PROPERTIES CXX_EXTENSIONS OFF
                        RUNTIME_OUTPUT_DIRECTORY ${PROJECT_BINARY_DIR}/bin)
  linegate_unity(${name} 8)
  install(TARGETS ${name} RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT gateway)
endfunction()

# linegate_test_code(TARGET LEVEL [FAST_DDS]): how the sources of a test program, or of a library that several have, are
# compiled; LEVEL: -O0 but for those that work for seconds. More than -O1 takes longer to compile than it saves.
function(linegate_test_code target level)
  set(options ${level})
  if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
    list(APPEND options --param=ggc-min-heapsize=524288)  # kB of memory before GCC looks for what it can free
    if(CMAKE_BUILD_TYPE STREQUAL "RelWithDebInfo")
      list(APPEND options -g0)  # the presets debug and asan have the lines of tests
    endif()
  endif()
  set_target_properties(${target} PROPERTIES CXX_EXTENSIONS OFF)
  target_compile_options(${target} PRIVATE ${options})
  linegate_precompile(${target} GTEST ${ARGN} ${options})
  linegate_unity(${target} 0)
endfunction()

# Test programs are linked by lld where it is installed: a change in the stack links all of them anew.
set(LINEGATE_TEST_LINKER "")
find_program(LINEGATE_LLD ld.lld)
if(LINEGATE_LLD)
  set(LINEGATE_TEST_LINKER lld)
endif()
function(linegate_link_quickly target)
  if(LINEGATE_TEST_LINKER)
    target_link_options(${target} PRIVATE -fuse-ld=${LINEGATE_TEST_LINKER})
  endif()
endfunction()

# linegate_paths(TARGET NAME path ...) gives TARGET paths of tests/paths.h. A path may be a generator expression.
function(linegate_paths target)
  list(GET ARGN 0 first)
  set(source ${CMAKE_CURRENT_BINARY_DIR}/${target}_${first}.cpp)
  set(text "#include \"tests/paths.h\"\n\n")
  while(ARGN)
    list(POP_FRONT ARGN name path)
    string(APPEND text "const char* const linegate::paths::${name} = \"${path}\";\n")
  endwhile()
  file(GENERATE OUTPUT ${source} CONTENT "${text}" TARGET ${target})
  target_sources(${target} PRIVATE ${source})
endfunction()

# What the names of tests begin with: tests/run runs those of all presets together.
set(LINEGATE_TEST_PREFIX "")
if(LINEGATE_BUILD_FUZZ)
  set(LINEGATE_TEST_PREFIX asan.)
endif()
if("thread" IN_LIST LINEGATE_SANITIZE)
  set(LINEGATE_TEST_PREFIX tsan.)
endif()

# linegate_test_program(NAME SOURCES ... DEPENDS ...) makes a program that tests start.
function(linegate_test_program name)
  cmake_parse_arguments(ARG "" "" "SOURCES;DEPENDS" ${ARGN})
  add_executable(${name} ${ARG_SOURCES})
  target_link_libraries(${name} PRIVATE linegate_flags linegate_warnings ${ARG_DEPENDS})
  set_target_properties(${name} PROPERTIES CXX_EXTENSIONS OFF)
  linegate_precompile(${name})
  linegate_link_quickly(${name})
  linegate_unity(${name} 1)
endfunction()

# linegate_test(NAME TIER unit [OPTIMISED] [NO_THREADS] [FAST_DDS] [LONGEST pattern] SOURCES ... DEPENDS ...) makes a GoogleTest
# program whose cases carry the tier as their CTest label. Its own sources are not optimised; OPTIMISED is for those that
# work for seconds. NO_THREADS: it starts none, so it is not built under the thread sanitizer. FAST_DDS: its sources
# include headers of Fast DDS. LONGEST: a filter of GoogleTest for the case that has to start first, or all wait for its end.
function(linegate_test name)
  if(NOT LINEGATE_BUILD_TESTS)
    return()
  endif()
  cmake_parse_arguments(ARG "OPTIMISED;NO_THREADS;FAST_DDS" "TIER;TIMEOUT;LONGEST" "SOURCES;DEPENDS" ${ARGN})
  if(NOT ARG_TIMEOUT)
    set(ARG_TIMEOUT 120)
  endif()
  add_executable(${name} ${ARG_SOURCES} ${PROJECT_SOURCE_DIR}/tests/print_assertions.cpp)
  target_link_libraries(${name} PRIVATE linegate_flags linegate_warnings ${ARG_DEPENDS} linegate::base
                        GTest::gmock GTest::gtest_main)
  if(ARG_NO_THREADS AND "thread" IN_LIST LINEGATE_SANITIZE)
    set_target_properties(${name} PROPERTIES EXCLUDE_FROM_ALL ON)
  endif()
  set(level -O0)
  if(ARG_OPTIMISED)
    set(level -O1)
  endif()
  set(fast_dds)
  if(ARG_FAST_DDS)
    set(fast_dds FAST_DDS)
  endif()
  linegate_test_code(${name} ${level} ${fast_dds})
  linegate_link_quickly(${name})
  if(ARG_TIER STREQUAL "unit")  # a process takes longer to start than most cases take
    linegate_group_cases(${name} ${ARG_TIER} ${ARG_TIMEOUT})
    return()
  endif()
  set(properties LABELS ${ARG_TIER} TIMEOUT ${ARG_TIMEOUT})
  set(cost 0)  # of cases of equal cost CTest knows, from the run before, which one takes longer
  if(ARG_TIER STREQUAL "dds")
    # Those of a program run one after the other, because a test has up to four processes, and early, or nothing runs
    # beside the last of them. Programs run at the same time, those of both sanitizers, too: each test has a domain of its
    # own (tests/dds/own_domain.h).
    list(APPEND properties RESOURCE_LOCK ${LINEGATE_TEST_PREFIX}${name})
    set(cost 500)
  elseif(ARG_OPTIMISED)
    set(cost 100)
  endif()
  set(prefix ${LINEGATE_TEST_PREFIX}${ARG_TIER}.)
  set(discovery DISCOVERY_MODE PRE_TEST DISCOVERY_TIMEOUT 60 PROPERTIES ${properties})
  set(rest)
  if(ARG_LONGEST)
    gtest_discover_tests(${name} TEST_PREFIX "${prefix}" TEST_FILTER ${ARG_LONGEST} ${discovery} COST 1000)
    set(rest TEST_FILTER -${ARG_LONGEST})
  endif()
  gtest_discover_tests(${name} TEST_PREFIX "${prefix}" ${rest} ${discovery} COST ${cost})
endfunction()

# linegate_group_cases(NAME TIER TIMEOUT) makes one test of all cases of the program NAME, if that is built; TIMEOUT is
# that of each case, in seconds. What came of each case is in results/cases/TEST.xml, where tests/run looks for it.
function(linegate_group_cases name tier timeout)
  set(prefix ${LINEGATE_TEST_PREFIX}${tier}.)
  set(test ${prefix}${name})
  math(EXPR most "10 * ${timeout}")
  set(file ${CMAKE_CURRENT_BINARY_DIR}/${name}_cases.cmake)
  file(GENERATE OUTPUT ${file} CONTENT "if(EXISTS \"$<TARGET_FILE:${name}>\")
  add_test(${test} /usr/bin/python3 -B \"${PROJECT_SOURCE_DIR}/tests/cases.py\" run
           \"${PROJECT_BINARY_DIR}/results/cases/${test}.xml\" ${timeout} ${prefix} \"$<TARGET_FILE:${name}>\")
  set_tests_properties(${test} PROPERTIES LABELS ${tier} TIMEOUT ${most})
endif()
")
  set_property(DIRECTORY APPEND PROPERTY TEST_INCLUDE_FILES ${file})
endfunction()

# linegate_readme_example(NAME README file LANGUAGE cpp DEPENDS ...) makes an executable of the first
# fenced block of that language in a README.md: an example that went stale breaks the build. The block
# is cut out by position and not as a list, because CMake would divide the code at its semicolons.
function(linegate_readme_example name)
  cmake_parse_arguments(ARG "" "README;LANGUAGE" "DEPENDS" ${ARGN})
  set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${ARG_README})
  file(READ ${ARG_README} text)
  set(fence "```${ARG_LANGUAGE}\n")
  string(FIND "${text}" "${fence}" begin)
  if(begin EQUAL -1)
    message(FATAL_ERROR "${ARG_README} has no block of ${ARG_LANGUAGE}")
  endif()
  string(LENGTH "${fence}" length)
  math(EXPR begin "${begin} + ${length}")
  string(SUBSTRING "${text}" ${begin} -1 block)
  string(FIND "${block}" "```" end)
  string(SUBSTRING "${block}" 0 ${end} block)
  set(source ${CMAKE_CURRENT_BINARY_DIR}/${name}.${ARG_LANGUAGE})
  file(CONFIGURE OUTPUT ${source} CONTENT "${block}" @ONLY)
  add_executable(${name} ${source})
  target_link_libraries(${name} PRIVATE ${ARG_DEPENDS})
endfunction()
