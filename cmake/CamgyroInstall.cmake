# Install rules: the libraries and their headers for find_package(camgyro), and the program.
include(GNUInstallDirs)
# What has no component of its own is for those who build against the libraries (CamgyroPackages).
set(CMAKE_INSTALL_DEFAULT_COMPONENT_NAME dev)
include(CMakePackageConfigHelpers)

# Libraries under tools/ are parts of the program, and the simulator serves it and the tests.
get_property(all_libraries GLOBAL PROPERTY CAMGYRO_LIBRARIES)
foreach(library ${all_libraries})
  get_target_property(directory ${library} SOURCE_DIR)
  if(NOT directory MATCHES "^${PROJECT_SOURCE_DIR}/(simulation|tools)(/|$)")
    list(APPEND libraries ${library})
  endif()
endforeach()
install(TARGETS ${libraries} EXPORT camgyroTargets ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR}
        INCLUDES DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/camgyro)

# Included as in this repository: "core/calibration.h". Of the readers only the entrance is public.
install(DIRECTORY core factors frontend estimator pipeline
        DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/camgyro
        FILES_MATCHING PATTERN "*.h" PATTERN "readers" EXCLUDE)
install(FILES frontend/readers/read_recording.h frontend/readers/repair_stamps.h
        DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/camgyro/frontend/readers)

# libcamgyro and its headers, <camgyro/calibrator.h>. An export set of its own: a program that uses
# only them needs none of what the static libraries need.
install(TARGETS camgyro_camgyro EXPORT camgyroApiTargets
        LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT library NAMELINK_COMPONENT dev)
get_target_property(api_headers camgyro_camgyro CAMGYRO_PUBLIC_HEADERS)
foreach(header ${api_headers})
  if(header STREQUAL "version.h")
    install(FILES ${PROJECT_BINARY_DIR}/include/camgyro/version.h
            DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/camgyro)
  else()
    install(FILES camgyro/${header} DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/camgyro)
  endif()
endforeach()

set(package_dir ${CMAKE_INSTALL_LIBDIR}/cmake/camgyro)
install(EXPORT camgyroTargets NAMESPACE camgyro:: DESTINATION ${package_dir})
install(EXPORT camgyroApiTargets NAMESPACE camgyro:: DESTINATION ${package_dir})
configure_package_config_file(cmake/camgyroConfig.cmake.in ${PROJECT_BINARY_DIR}/camgyroConfig.cmake
                              INSTALL_DESTINATION ${package_dir})
write_basic_package_version_file(${PROJECT_BINARY_DIR}/camgyroConfigVersion.cmake
                                 COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_SOURCE_DIR}/cmake/FindRosbagStorage.cmake
              ${PROJECT_BINARY_DIR}/camgyroConfig.cmake
              ${PROJECT_BINARY_DIR}/camgyroConfigVersion.cmake
        DESTINATION ${package_dir})

install(TARGETS camgyro RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT program)

# Manual pages and bash completion, from what the program says of itself.
find_program(CAMGYRO_PYTHON3 python3)
if(CAMGYRO_PYTHON3)
  set(help_files ${PROJECT_BINARY_DIR}/help_files)
  add_custom_command(OUTPUT ${help_files}/completions/camgyro VERBATIM
                     DEPENDS camgyro ${PROJECT_SOURCE_DIR}/tools/help_files.py
                     COMMAND ${CAMGYRO_PYTHON3} ${PROJECT_SOURCE_DIR}/tools/help_files.py
                             $<TARGET_FILE:camgyro> ${help_files})
  add_custom_target(camgyro_help_files ALL DEPENDS ${help_files}/completions/camgyro)
  install(DIRECTORY ${help_files}/man1 DESTINATION ${CMAKE_INSTALL_MANDIR} COMPONENT program)
  install(FILES ${help_files}/completions/camgyro COMPONENT program
          DESTINATION ${CMAKE_INSTALL_DATADIR}/bash-completion/completions)
else()
  message(STATUS "python3 not found: no manual pages, no bash completion")
endif()
