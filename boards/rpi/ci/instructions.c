// A plugin of QEMU's user-mode emulator (docs/devel/tcg-plugins.rst): counts the instructions that a program executes, and
// says at its end how many, and in which functions. Every version of the interface has what it uses.
//
//   cc -shared -fPIC -O2 -o instructions.so instructions.c
//   qemu-aarch64 -plugin ./instructions.so -d plugin PROGRAM       prints `COUNT FUNCTION`, a line each, to stderr

#include <inttypes.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

// The part of qemu-plugin.h that is used; Debian ships no such header with its emulator.
typedef uint64_t qemu_plugin_id_t;
struct qemu_info_t;
struct qemu_plugin_tb;
struct qemu_plugin_insn;
enum { NO_REGISTERS = 0 };
typedef void (*translated_t)(qemu_plugin_id_t, struct qemu_plugin_tb *);
typedef void (*executed_t)(unsigned vcpu, void *data);
typedef void (*ended_t)(qemu_plugin_id_t, void *data);
void qemu_plugin_register_vcpu_tb_trans_cb(qemu_plugin_id_t, translated_t);
void qemu_plugin_register_vcpu_tb_exec_cb(struct qemu_plugin_tb *, executed_t, int registers, void *data);
void qemu_plugin_register_atexit_cb(qemu_plugin_id_t, ended_t, void *data);
size_t qemu_plugin_tb_n_insns(const struct qemu_plugin_tb *);
struct qemu_plugin_insn *qemu_plugin_tb_get_insn(const struct qemu_plugin_tb *, size_t index);
const char *qemu_plugin_insn_symbol(const struct qemu_plugin_insn *);
void qemu_plugin_outs(const char *);

__attribute__((visibility("default"))) int qemu_plugin_version = 1;

// Instructions one after the other without a branch, each time that they are translated.
struct block {
    struct block *before;
    const char *function;
    uint64_t instructions, times;
};
static struct block *last;

static void executed(unsigned vcpu, void *data) {
    (void)vcpu;
    ((struct block *)data)->times++;
}

static void translated(qemu_plugin_id_t id, struct qemu_plugin_tb *tb) {
    (void)id;
    struct block *block = calloc(1, sizeof *block);
    if (!block) abort();
    const char *function = qemu_plugin_insn_symbol(qemu_plugin_tb_get_insn(tb, 0));
    *block = (struct block){last, function ? function : "", qemu_plugin_tb_n_insns(tb), 0};
    last = block;
    qemu_plugin_register_vcpu_tb_exec_cb(tb, executed, NO_REGISTERS, block);
}

static int by_function(const void *a, const void *b) {
    return strcmp((*(struct block *const *)a)->function, (*(struct block *const *)b)->function);
}

static void ended(qemu_plugin_id_t id, void *data) {
    (void)id, (void)data;
    size_t blocks = 0, at = 0;
    for (struct block *block = last; block; block = block->before) blocks++;
    struct block **all = calloc(blocks + 1, sizeof *all);
    if (!all) abort();
    for (struct block *block = last; block; block = block->before) all[at++] = block;
    qsort(all, blocks, sizeof *all, by_function);
    for (at = 0; at < blocks;) {
        const char *function = all[at]->function;
        uint64_t count = 0;
        for (; at < blocks && !strcmp(all[at]->function, function); at++) count += all[at]->instructions * all[at]->times;
        char line[600];
        snprintf(line, sizeof line, "%" PRIu64 " %s\n", count, *function ? function : "?");
        if (count) qemu_plugin_outs(line);
    }
}

__attribute__((visibility("default"))) int qemu_plugin_install(qemu_plugin_id_t id, const struct qemu_info_t *info, int argc,
                                                               char **argv) {
    (void)info, (void)argc, (void)argv;
    qemu_plugin_register_vcpu_tb_trans_cb(id, translated);
    qemu_plugin_register_atexit_cb(id, ended, NULL);
    return 0;
}
