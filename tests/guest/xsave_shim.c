// SPDX-License-Identifier: Apache-2.0
// Preloaded into the User Mode Linux process only.
//
// UML keeps the registers of each guest process and writes them back with ptrace(PTRACE_SETREGSET,
// NT_X86_XSTATE). Version 6.1 reserves 2696 bytes for that state. The host accepts it only in full
// size, and a CPU with AMX has 11008 bytes: the call fails with EFAULT and UML ends with
// "fatal_sigsegv" before the first guest process has run. So the shim determines the full size from
// the first PTRACE_GETREGSET and pads the state that UML writes with zeros, which is the initial
// state of the registers that UML does not support. If the sizes are equal it does nothing.
#define _GNU_SOURCE
#include <dlfcn.h>
#include <elf.h>
#include <stdarg.h>
#include <string.h>
#include <sys/ptrace.h>
#include <sys/uio.h>

typedef long (*ptrace_function)(int request, pid_t pid, void* address, void* data);

static ptrace_function next_ptrace;
static size_t full_size;  // size of the host's XSAVE area; 0: not determined yet
static _Alignas(64) unsigned char area[32768];

__attribute__((constructor)) static void find_next(void) {
  next_ptrace = (ptrace_function)dlsym(RTLD_NEXT, "ptrace");
}

static void learn_full_size(pid_t pid) {
  struct iovec whole = {area, sizeof area};
  if (next_ptrace(PTRACE_GETREGSET, pid, (void*)NT_X86_XSTATE, &whole) == 0) {
    full_size = whole.iov_len;
  }
}

static long set_lengthened(pid_t pid, const struct iovec* given) {
  memcpy(area, given->iov_base, given->iov_len);
  memset(area + given->iov_len, 0, full_size - given->iov_len);
  struct iovec whole = {area, full_size};
  return next_ptrace(PTRACE_SETREGSET, pid, (void*)NT_X86_XSTATE, &whole);
}

long ptrace(enum __ptrace_request request, ...) {
  va_list rest;
  va_start(rest, request);
  pid_t pid = va_arg(rest, pid_t);
  void* address = va_arg(rest, void*);
  void* data = va_arg(rest, void*);
  va_end(rest);

  if (address == (void*)NT_X86_XSTATE) {
    if (request == PTRACE_GETREGSET && full_size == 0) {
      learn_full_size(pid);
    }
    const struct iovec* given = data;
    if (request == PTRACE_SETREGSET && given->iov_len < full_size) {
      return set_lengthened(pid, given);
    }
  }
  return next_ptrace(request, pid, address, data);
}
