// SPDX-License-Identifier: Apache-2.0
#include "bridges/dds/guard/imports.h"

#include <cstddef>
#include <cstdint>

#include <elf.h>
#include <link.h>
#include <sys/mman.h>
#include <unistd.h>

namespace linegate::dds::guard {
namespace {

static_assert(sizeof(void*) == sizeof(Elf64_Addr), "relocations with addends");

struct Wanted {
  std::string_view file;  // the begin of its name
  std::string_view function;
  void* replacement = nullptr;
  bool replaced = false;  // the result
};

// The tables of a loaded library.
struct Tables {
  const char* names = nullptr;
  const Elf64_Sym* symbols = nullptr;
  const Elf64_Rela* calls = nullptr;  // DT_JMPREL
  std::size_t calls_size = 0;         // in octets
  const Elf64_Rela* data = nullptr;   // DT_RELA
  std::size_t data_size = 0;
};

template <class Table>
const Table* at(Elf64_Addr address) {
  return reinterpret_cast<const Table*>(address);  // the dynamic linker has relocated it
}

Tables tables_of(const dl_phdr_info& it, const Elf64_Phdr& dynamic) {
  Tables out;
  for (const auto* entry = at<Elf64_Dyn>(it.dlpi_addr + dynamic.p_vaddr); entry->d_tag != DT_NULL;
       ++entry) {
    switch (entry->d_tag) {
      case DT_STRTAB:
        out.names = at<char>(entry->d_un.d_ptr);
        break;
      case DT_SYMTAB:
        out.symbols = at<Elf64_Sym>(entry->d_un.d_ptr);
        break;
      case DT_JMPREL:
        out.calls = at<Elf64_Rela>(entry->d_un.d_ptr);
        break;
      case DT_PLTRELSZ:
        out.calls_size = entry->d_un.d_val;
        break;
      case DT_RELA:
        out.data = at<Elf64_Rela>(entry->d_un.d_ptr);
        break;
      case DT_RELASZ:
        out.data_size = entry->d_un.d_val;
        break;
      default:
        break;
    }
  }
  return out;
}

std::size_t page_size() {
  return static_cast<std::size_t>(::sysconf(_SC_PAGESIZE));
}

// The page is read-only if the library was linked with -z relro.
bool write(std::uintptr_t slot, void* value, bool read_only) {
  const std::size_t page = page_size();
  auto* const begin = reinterpret_cast<void*>(slot & ~(page - 1));
  if (read_only && ::mprotect(begin, page, PROT_READ | PROT_WRITE) != 0)
    return false;
  // One store: another thread calls either function.
  __atomic_store_n(reinterpret_cast<void**>(slot), value, __ATOMIC_RELEASE);
  return !read_only || ::mprotect(begin, page, PROT_READ) == 0;
}

bool is_read_only(const dl_phdr_info& it, std::uintptr_t address) {
  for (std::size_t i = 0; i < it.dlpi_phnum; ++i) {
    const Elf64_Phdr& part = it.dlpi_phdr[i];
    if (part.p_type == PT_GNU_RELRO &&
        is_relro(address, it.dlpi_addr + part.p_vaddr, part.p_memsz, page_size()))
      return true;
  }
  return false;
}

void replace(const dl_phdr_info& it, const Tables& tables, const Elf64_Rela* relocations,
             std::size_t octets, Wanted& wanted) {
  for (std::size_t i = 0; relocations != nullptr && i < octets / sizeof *relocations; ++i) {
    const std::size_t symbol = ELF64_R_SYM(relocations[i].r_info);
    if (symbol == 0 || wanted.function != tables.names + tables.symbols[symbol].st_name)
      continue;
    const std::uintptr_t slot = it.dlpi_addr + relocations[i].r_offset;
    wanted.replaced = write(slot, wanted.replacement, is_read_only(it, slot)) || wanted.replaced;
  }
}

int visit(dl_phdr_info* it, std::size_t, void* data) {
  auto& wanted = *static_cast<Wanted*>(data);
  const std::string_view path(it->dlpi_name);
  if (path.substr(path.rfind('/') + 1).rfind(wanted.file, 0) != 0)
    return 0;
  for (std::size_t i = 0; i < it->dlpi_phnum; ++i) {
    if (it->dlpi_phdr[i].p_type != PT_DYNAMIC)
      continue;
    const Tables tables = tables_of(*it, it->dlpi_phdr[i]);
    if (tables.names == nullptr || tables.symbols == nullptr)
      continue;
    replace(*it, tables, tables.calls, tables.calls_size, wanted);
    replace(*it, tables, tables.data, tables.data_size, wanted);
  }
  return 1;
}

}  // namespace

bool is_relro(std::uintptr_t address, std::uintptr_t begin, std::size_t size, std::size_t page) {
  const std::uintptr_t whole = ~(std::uintptr_t{page} - 1);
  return address >= (begin & whole) && address < ((begin + size) & whole);
}

bool replace_import(std::string_view library, std::string_view function, void* replacement) {
  Wanted wanted{library, function, replacement};
  ::dl_iterate_phdr(visit, &wanted);
  return wanted.replaced;
}

}  // namespace linegate::dds::guard
