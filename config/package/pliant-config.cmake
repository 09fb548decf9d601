# SPDX-License-Identifier: MIT
# find_package(pliant): the client library, shared (pliant::client) and static (pliant::client_static).
include(${CMAKE_CURRENT_LIST_DIR}/pliant-targets.cmake)
