# Debian packages, one per install component: `cpack -G DEB` in a build folder that was configured
# with the prefix /usr, since the multiarch folder of libraries follows from it (tools/packages.sh).
set(CPACK_PACKAGE_NAME camgyro)
set(CPACK_PACKAGE_VERSION ${PROJECT_VERSION})
set(CPACK_PACKAGE_CONTACT "camgyro developers <developers@camgyro.example>")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "calibration of a rolling-shutter camera with a gyroscope")
set(CPACK_PACKAGE_DESCRIPTION
"Estimates focal length, principal point, readout time, the delay between the
two clocks, gyro bias and the mounting of a camera and a gyroscope, each with
its uncertainty, from one hand-held recording and without a target.")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_GENERATOR DEB)

set(CPACK_COMPONENTS_ALL program library dev)
if(TARGET camgyro_python)
  list(APPEND CPACK_COMPONENTS_ALL python)
endif()
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_GENERATE_SHLIBS ON)
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)
set(CPACK_DEBIAN_ENABLE_COMPONENT_DEPENDS OFF)

set(CPACK_DEBIAN_PROGRAM_PACKAGE_NAME camgyro)
set(CPACK_DEBIAN_PROGRAM_PACKAGE_SECTION science)
set(CPACK_DEBIAN_PROGRAM_DESCRIPTION "${CPACK_PACKAGE_DESCRIPTION}")

# Named after what programs are linked with.
get_target_property(soversion camgyro_camgyro SOVERSION)
set(library_package libcamgyro${soversion})
set(CPACK_DEBIAN_LIBRARY_PACKAGE_NAME ${library_package})
set(CPACK_DEBIAN_LIBRARY_PACKAGE_SECTION libs)
set(CPACK_DEBIAN_LIBRARY_DESCRIPTION "${CPACK_PACKAGE_DESCRIPTION_SUMMARY}: library\n${CPACK_PACKAGE_DESCRIPTION}")
set(CPACK_DEBIAN_LIBRARY_PACKAGE_CONTROL_EXTRA ${CMAKE_CURRENT_LIST_DIR}/triggers)

set(CPACK_DEBIAN_DEV_PACKAGE_NAME libcamgyro-dev)
set(CPACK_DEBIAN_DEV_PACKAGE_SECTION libdevel)
set(CPACK_DEBIAN_DEV_DESCRIPTION "${CPACK_PACKAGE_DESCRIPTION_SUMMARY}: headers\n${CPACK_PACKAGE_DESCRIPTION}")
# What camgyroConfig.cmake looks for (as in tools/install_deps.sh).
set(dev_depends
  "${library_package} (= ${PROJECT_VERSION})" libeigen3-dev libceres-dev libsuitesparse-dev
  libopencv-dev libavformat-dev libavcodec-dev libswscale-dev libavutil-dev libyaml-cpp-dev
  libexpected-dev libsqlite3-dev liblz4-dev libzstd-dev pkg-config)
if(CAMGYRO_WITH_PROTOBUF)
  list(APPEND dev_depends libprotobuf-dev)
endif()
list(JOIN dev_depends ", " CPACK_DEBIAN_DEV_PACKAGE_DEPENDS)

set(CPACK_DEBIAN_PYTHON_PACKAGE_NAME python3-camgyro)
set(CPACK_DEBIAN_PYTHON_PACKAGE_SECTION python)
set(CPACK_DEBIAN_PYTHON_DESCRIPTION "${CPACK_PACKAGE_DESCRIPTION_SUMMARY}: Python 3\n${CPACK_PACKAGE_DESCRIPTION}")
if(TARGET camgyro_python)
  get_target_property(minor camgyro_python CAMGYRO_PYTHON_MINOR)
  math(EXPR next_minor "${minor} + 1")
  set(CPACK_DEBIAN_PYTHON_PACKAGE_DEPENDS
      "python3 (>= 3.${minor}), python3 (<< 3.${next_minor}), python3-numpy")
endif()

# Debian's policy: every package has its licence and its changes.
find_program(CAMGYRO_GZIP gzip REQUIRED)
set(changelog ${PROJECT_BINARY_DIR}/changelog.gz)
add_custom_command(OUTPUT ${changelog} DEPENDS ${PROJECT_SOURCE_DIR}/CHANGELOG.md VERBATIM
                   COMMAND ${CAMGYRO_GZIP} -9nc ${PROJECT_SOURCE_DIR}/CHANGELOG.md > ${changelog})
add_custom_target(camgyro_changelog ALL DEPENDS ${changelog})
foreach(component ${CPACK_COMPONENTS_ALL})
  string(TOUPPER ${component} upper)
  set(doc ${CMAKE_INSTALL_DATADIR}/doc/${CPACK_DEBIAN_${upper}_PACKAGE_NAME})
  install(FILES ${PROJECT_SOURCE_DIR}/LICENSE DESTINATION ${doc} RENAME copyright
          COMPONENT ${component})
  install(FILES ${changelog} DESTINATION ${doc} COMPONENT ${component})
endforeach()
include(CPack)
