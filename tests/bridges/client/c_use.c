// SPDX-License-Identifier: Apache-2.0
/* A program in C99 that uses linegate.h. Returns 0, or the number of the step that failed. */
#include "bridges/client/linegate.h"

int use_in_c(linegate_client* client);
int use_commands_in_c(linegate_client* client);

static void on_values(void* user, const linegate_value* values, size_t count,
                      const linegate_image* image) {
  (void)image;
  if (count == 1 && values[0].quality == LINEGATE_GOOD)
    *(double*)user = values[0].number;
}

int use_in_c(linegate_client* client) {
  const char* const names[] = {"ram.In"};
  linegate_value value;
  linegate_options options = {0};
  char error[80];
  double seen = 0;
  const int line = linegate_line(client, "press");
  if (line <= 0 || linegate_line_wait(client, line, 0) != LINEGATE_OK)
    return 1;
  if (linegate_read(client, line, names, 1, &value, NULL) != 1 || value.unsigned_integer != 5)
    return 2;
  if (linegate_subscribe(client, line, names, 1, on_values, &seen) <= 0 ||
      linegate_poll(client, 0) != LINEGATE_OK || seen != 5)
    return 3;
  if (linegate_set_real(client, line, "ram.Out", 1) != LINEGATE_ERROR_ARGUMENT)
    return 4;
  options.size = 1;
  if (linegate_connect(&options, error, sizeof error) != NULL || error[0] == 0)
    return 5;
  return linegate_error_text(LINEGATE_ERROR_NAME)[0] == 0 ? 6 : 0;
}

int use_commands_in_c(linegate_client* client) {
  linegate_boot_result boot = {.size = sizeof boot};
  const int line = linegate_line(client, "press");
  const int call = linegate_boot(client, line, 0, LINEGATE_LONG);
  if (linegate_call_wait(client, call) <= 0)
    return 1;
  if (linegate_call_boot(client, call, 0, &boot) != LINEGATE_OK || boot.node != 3 || !boot.ok)
    return 2;
  if (linegate_call_boot(client, call, 1, &boot) != LINEGATE_ERROR_NAME)
    return 3;
  return linegate_free(client, call) != LINEGATE_OK ? 4 : 0;
}
