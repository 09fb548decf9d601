// SPDX-License-Identifier: MIT
#include "run/input.h"

#include <stdio.h>
#include <string.h>

void gate_init(Gate *gate, Sim *sim, double timeout_s, Arena *arena)
{
    memset(gate, 0, sizeof *gate);
    gate->sim = sim;
    gate->timeout_us = (int64_t)(timeout_s * 1e6);
    gate->owner = arena_allocate(arena, ARENA_OUTPUT, (size_t)sim_tool_count(sim),
                                 sizeof *gate->owner, "run/tool_owners");
}

// Finds a request by channel, sender and id: clients may count per channel or over all.
static GateEntry *find_entry(Gate *gate, InputKind kind, int32_t sender, int32_t id)
{
    for (int i = 0; i < GATE_ANSWERS; i++) {
        GateEntry *entry = &gate->entry[i];
        if (entry->used && entry->sender == sender && entry->id == id && entry->kind == kind)
            return entry;
    }
    return NULL;
}

// True if a repeat of the request may still come. A clock that went back makes none young.
static bool is_young(const Gate *gate, const GateEntry *entry)
{
    const int64_t age_us = gate->now_us - entry->time_us;
    return entry->pending || (age_us >= 0 && age_us < GATE_REPEAT_US);
}

// Remembers an admitted request. A place is free, or that of the oldest request of which no repeat
// comes anymore; a sender that has more of them than are left to others displaces its own answered
// ones. False: there is none.
static bool remember(Gate *gate, const Input *input)
{
    const bool urgent = input_is_urgent(input->kind, input->command.kind);
    GateEntry *oldest = NULL, *own = NULL;
    int own_count = 0, left = 0;
    for (int i = urgent ? 0 : GATE_URGENT; i < GATE_ANSWERS; i++) {
        GateEntry *entry = &gate->entry[i];
        const bool open = !entry->used || !is_young(gate, entry);
        left += open;
        if (open &&
            (oldest == NULL || (oldest->used && (!entry->used || entry->number < oldest->number))))
            oldest = entry;
        if (!entry->used || entry->sender != input->sender)
            continue;
        own_count++;
        if (!entry->pending && (own == NULL || entry->number < own->number))
            own = entry;
    }
    GateEntry *entry = own_count > left && own != NULL ? own : oldest;
    if (entry == NULL)
        return false;
    *entry = (GateEntry){.used = true,
                         .pending = true,
                         .urgent = urgent,
                         .kind = input->kind,
                         .sender = input->sender,
                         .id = input->id,
                         .time_us = gate->now_us,
                         .number = gate->requests++};
    return true;
}

// True if a newer pose of the same sender arrived earlier. Both its count and its clock must say
// so: a client may count as it likes, and its clock may be set back.
static bool was_overtaken(const ToolOwner *owner, const Input *input)
{
    enum { MOST = 1024 }; // poses of a second
    int32_t ahead = (int32_t)((uint32_t)input->id - (uint32_t)owner->sequence);
    return ahead < 0 && ahead >= -MOST && input->utime < owner->utime;
}

// Checks that the sender owns the tool. The first sender that makes a tool active owns it until it
// is stale or withdrawn.
static Refusal check_owner(Gate *gate, const Input *input, int64_t now_us, char *why)
{
    ToolOwner *owner = &gate->owner[input->index];
    bool recent = now_us - owner->last_us <= gate->timeout_us;
    bool fresh = owner->owned && recent;
    // A tool belongs to its sender until that is silent for long enough.
    if (fresh && owner->sender != input->sender) {
        snprintf(why, INPUT_WHY_MAX, "tool %d belongs to sender %d, pose of sender %d refused",
                 input->pose.tool, owner->sender, input->sender);
        return REFUSED_OWNER;
    }
    // Also after a withdrawal: a pose that was overtaken must not take the tool again.
    if (recent && owner->sender == input->sender && was_overtaken(owner, input)) {
        snprintf(why, INPUT_WHY_MAX, "tool %d: pose %d came after pose %d of its sender",
                 input->pose.tool, input->id, owner->sequence);
        return REFUSED_LATE;
    }
    // The pose is taken: remember its sender, and its number for the next one.
    *owner = (ToolOwner){.owned = input->pose.active,
                         .sender = input->sender,
                         .last_us = now_us,
                         .sequence = input->id,
                         .utime = input->utime};
    return ACCEPTED;
}

void gate_pass(Gate *gate, InputKind kind, const void *data, size_t size, int64_t now_us,
               GateResult *result)
{
    gate->now_us = now_us;
    result->answer = NULL;
    result->why[0] = '\0';
    Input *input = &result->input;
    // Decode; only a message that is known can be answered.
    Refusal refusal = input_decode(kind, data, size, input, result->why);
    result->known = refusal == ACCEPTED;
    // A repeat of a request gets the stored answer, or waits for it.
    if (result->known && input_is_request(input)) {
        GateEntry *entry = find_entry(gate, kind, input->sender, input->id);
        if (entry != NULL) {
            result->passage = entry->pending ? PASSAGE_PENDING : PASSAGE_ANSWERED;
            result->refusal = ACCEPTED;
            result->answer = &gate->answer[entry - gate->entry];
            return;
        }
    }
    // New messages: values first, then who owns the tool.
    if (refusal == ACCEPTED)
        refusal = input_check(input, gate->sim, result->why);
    if (refusal == ACCEPTED && kind == INPUT_POSE)
        refusal = check_owner(gate, input, now_us, result->why);
    // What is refused takes no place: it would be refused again. What is not remembered must not be
    // executed, since its repeat would be, too; but a PAUSE or STOP may be, so that no flood of
    // them keeps one away.
    if (refusal == ACCEPTED && input_is_request(input) && !remember(gate, input) &&
        !input_is_urgent(kind, input->command.kind)) {
        refusal = REFUSED_FULL;
        snprintf(result->why, INPUT_WHY_MAX, "%d requests of the last %d s are remembered, no more",
                 GATE_ANSWERS, GATE_REPEAT_US / 1000000);
    }
    result->refusal = refusal;
    result->passage = refusal == ACCEPTED ? PASSAGE_OPEN : PASSAGE_REFUSED;
    if (refusal != ACCEPTED)
        gate_count(gate, refusal);
    gate->foreign[kind] += refusal == REFUSED_TYPE;
}

void gate_answer(Gate *gate, const Answer *answer)
{
    GateEntry *entry = find_entry(gate, answer->kind, answer->sender, answer->id);
    if (entry == NULL)
        return;
    entry->pending = false;
    entry->time_us = gate->now_us; // its answer may be lost, and is asked for from now on
    Answer *kept = &gate->answer[entry - gate->entry];
    *kept = *answer;
    kept->after_frame = false; // a repeat is answered immediately
}

void gate_forget(Gate *gate, const Input *input)
{
    GateEntry *entry = find_entry(gate, input->kind, input->sender, input->id);
    if (entry != NULL)
        *entry = (GateEntry){0};
}

int gate_pending(const Gate *gate, int32_t sender, bool urgent)
{
    int count = 0;
    for (int i = 0; i < GATE_ANSWERS; i++) {
        const GateEntry *entry = &gate->entry[i];
        count +=
            entry->used && entry->pending && entry->sender == sender && entry->urgent == urgent;
    }
    return count;
}

void gate_count(Gate *gate, Refusal refusal)
{
    gate->refused[refusal]++;
}

int64_t gate_refused(const Gate *gate)
{
    int64_t count = 0;
    for (int i = ACCEPTED + 1; i < REFUSAL_COUNT; i++)
        count += gate->refused[i];
    return count;
}
