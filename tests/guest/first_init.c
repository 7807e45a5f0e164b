// SPDX-License-Identifier: Apache-2.0
/* The first process in the machine of ./boot-pci, alone in its initial RAM file system: loads
   the modules /modules/* in the order of their names, mounts the host's file system read-only,
   and executes the program there that the kernel parameter `then` names. */
#include <dirent.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/mount.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

static void die(const char* what) {
  perror(what);
  sleep(1);
  exit(1);
}

static void load_modules(void) {
  struct dirent** names = NULL;
  const int count = scandir("/modules", &names, NULL, alphasort);
  for (int i = 0; i < count; ++i) {
    if (names[i]->d_name[0] == '.')
      continue;
    char path[300];
    snprintf(path, sizeof path, "/modules/%s", names[i]->d_name);
    const int file = open(path, O_RDONLY | O_CLOEXEC);
    if (file < 0 || syscall(SYS_finit_module, file, "", 0) != 0)
      die(path);
    close(file);
  }
}

int main(void) {
  load_modules();
  mkdir("/host", 0755);
  if (mount("host", "/host", "9p", MS_RDONLY,
            "trans=virtio,version=9p2000.L,cache=loose,msize=262144") != 0)
    die("mount /host");
  if (chdir("/host") != 0 || mount(".", "/", NULL, MS_MOVE, NULL) != 0 || chroot(".") != 0 ||
      chdir("/") != 0)
    die("move to /host");
  char* then = getenv("then");
  if (then == NULL)
    die("then=");
  char* const words[] = {then, NULL};
  execv(then, words);
  die(then);
}
