// SPDX-License-Identifier: Apache-2.0
// Reads two inputs, holds one output and sends one command, whatever becomes of the gateway.
#include <linegate/linegate.h>
#include <stdio.h>
#include <time.h>

static const char* const names[] = {"angle.Position value", "panel.Read input bit.Input 1"};
static void on_values(void* user, const linegate_value* values, size_t count,
                      const linegate_image* image) {
  for (size_t i = 0; i < count; ++i)
    printf("%s = %g, %s\n", names[i], values[i].number, linegate_quality_text(values[i].quality));
}

static void on_group(void* client, int group, int state) {
  char text[128];
  linegate_group_state(client, group, text, sizeof text);
  printf("lamps: %s\n", text);
}

static void on_line(void* user, const char* gateway, const char* line, int status, int restarted,
                    int layout_changed) {
  printf("%s: %s\n", line, linegate_status_text(status));
}

int main(void) {
  char error[256];
  linegate_client* client = linegate_connect(NULL, error, sizeof error);
  if (client == NULL)
    return fprintf(stderr, "%s\n", error), 1;
  int press = linegate_line(client, "press");
  int lamps = linegate_group(client, press, "lamps", 1000, 1);
  linegate_subscribe(client, press, names, 2, on_values, NULL);
  linegate_subscribe_group(client, lamps, on_group, client);
  linegate_subscribe_lines(client, on_line, NULL);
  for (time_t next = 0; linegate_poll(client, 100) == LINEGATE_OK; fflush(stdout)) {
    int state = linegate_group_state(client, lamps, NULL, 0);
    if (state == LINEGATE_GROUP_TAKING || state == LINEGATE_GROUP_HELD || time(NULL) < next)
      continue;
    next = time(NULL) + 1;  // At the start and after each loss it decides to hold the lamps again.
    if (linegate_set_integer(client, lamps, "panel.Write output 8-bit.Outputs 1 to 8", 5) < 0 ||
        linegate_arm(client, lamps) < 0)  // the line is not ready
      continue;
    linegate_result result = {0};
    int vendor = linegate_sdo_read(client, press, 8, 0x1018, 1, 5000);
    linegate_call_wait(client, vendor);
    linegate_call_result(client, vendor, &result);
    linegate_free(client, vendor);
    printf("vendor: %llu %s\n", (unsigned long long)result.number, result.text);
  }
}
