// SPDX-License-Identifier: MIT
// What pages get: the newest of everything, once, when they are ready; bounded, whatever they do.
#include "board.h"
#include "client.h"
#include "test.h"

static Parcel *parcel(const char *text)
{
    return parcel_text(text);
}

static bool is(const Parcel *parcel, const char *text)
{
    return parcel->size == strlen(text) && memcmp(parcel->data, text, parcel->size) == 0;
}

static Board board;
static Round round_;

// Takes a round that must be there, and releases its parcels; returns their texts.
static const char *take(BoardPage *page)
{
    static char texts[256];
    size_t length = 0;
    assert_true(board_next_round(&board, page, 0, &round_));
    texts[0] = '\0';
    for (int k = 0; k < round_.parcels; k++) {
        length +=
            (size_t)snprintf(texts + length, sizeof texts - length, "%.*s ",
                             (int)round_.parcel[k]->size, (const char *)round_.parcel[k]->data);
        parcel_drop(round_.parcel[k]);
    }
    return texts;
}

static int begin(void **state)
{
    (void)state;
    board_init(&board);
    return 0;
}

static int end(void **state)
{
    (void)state;
    board_destroy(&board);
    return 0;
}

AROUND_EACH(begin, end)

TEST(a_late_page_gets_the_newest_of_everything_in_order)
{
    board_set(&board, BOARD_STATUS, parcel("status1"));
    board_set_body(&board, 1, parcel("mesh1"), parcel("rest1"), parcel("nodes1"));
    board_set_body(&board, 1, NULL, NULL, parcel("nodes2"));
    board_set_body(&board, 0, parcel("mesh0"), NULL, parcel("nodes0"));
    board_set(&board, BOARD_SCENE, parcel("scene"));
    board_set(&board, BOARD_STATUS, parcel("status2"));
    BoardPage *page = board_add_page(&board);
    assert_string_equal(take(page), "scene status2 mesh0 nodes0 mesh1 rest1 nodes2 ");
    board_remove_page(&board, page);
}

TEST(what_came_while_a_page_drew_is_replaced_by_what_is_newer)
{
    BoardPage *page = board_add_page(&board);
    board_set_body(&board, 0, parcel("mesh0"), NULL, parcel("nodes0"));
    take(page);
    for (int k = 0; k < 1000; k++) {
        board_set_body(&board, 0, NULL, NULL, parcel("older"));
        board_set_contact(&board, &(pliant_contact_t){.tool = 7, .depth = k});
        board_set_contact(&board, &(pliant_contact_t){.tool = 9, .depth = -k});
    }
    board_set_body(&board, 0, NULL, NULL, parcel("newest"));
    board_drawn(&board, page, round_.number);
    assert_string_equal(take(page), "newest ");
    assert_int_equal(round_.contacts, 2);
    expect_near(round_.contact[0].depth, 999.0, 0.0);
    expect_near(round_.contact[1].depth, -999.0, 0.0);
    board_remove_page(&board, page);
}

typedef struct Waiter {
    BoardPage *page;
    Round round;
    atomic_bool came;
    bool going;
    pthread_t thread;
} Waiter;

static void *wait_for_round(void *user)
{
    Waiter *waiter = user;
    waiter->going = board_next_round(&board, waiter->page, 0, &waiter->round);
    atomic_store(&waiter->came, true);
    return NULL;
}

TEST(a_page_that_does_not_answer_gets_no_further_round)
{
    static Waiter waiter;
    waiter.page = board_add_page(&board);
    board_set(&board, BOARD_STATUS, parcel("status1"));
    take(waiter.page);
    board_set(&board, BOARD_STATUS, parcel("status2"));
    board_drawn(&board, waiter.page, round_.number - 1); // not that round
    pthread_create(&waiter.thread, NULL, wait_for_round, &waiter);
    // Another page is served as ever, and the LCM thread is not held up.
    BoardPage *other = board_add_page(&board);
    for (int k = 0; k < 20; k++) {
        board_set(&board, BOARD_LINK, parcel("link"));
        take(other);
        board_drawn(&board, other, round_.number);
    }
    assert_false(atomic_load(&waiter.came));
    board_drawn(&board, waiter.page, 1);
    pthread_join(waiter.thread, NULL);
    assert_true(waiter.going);
    assert_int_equal(waiter.round.number, 2);
    assert_int_equal(waiter.round.parcels, 2);
    for (int k = 0; k < waiter.round.parcels; k++)
        parcel_drop(waiter.round.parcel[k]);
    board_remove_page(&board, waiter.page);
    board_remove_page(&board, other);
}

TEST(a_stopped_page_is_let_go)
{
    static Waiter waiter;
    waiter.page = board_add_page(&board);
    pthread_create(&waiter.thread, NULL, wait_for_round, &waiter);
    board_stop_page(&board, waiter.page);
    pthread_join(waiter.thread, NULL);
    assert_false(waiter.going);
    board_remove_page(&board, waiter.page);
}

TEST(the_newest_256_events_wait_for_a_page_that_stalls)
{
    BoardPage *page = board_add_page(&board);
    for (int k = 0; k < 1000; k++) {
        char text[32];
        snprintf(text, sizeof text, "event%d", k);
        board_send_all(&board, parcel(text));
    }
    assert_true(board_next_round(&board, page, 0, &round_));
    assert_int_equal(round_.parcels, OUTBOX_MAX);
    assert_true(is(round_.parcel[0], "event744"));
    assert_true(is(round_.parcel[OUTBOX_MAX - 1], "event999"));
    for (int k = 0; k < round_.parcels; k++)
        parcel_drop(round_.parcel[k]);
    assert_int_equal(page->dropped, 744);
    // Those that wait when a page goes are let go too: the leak checker looks.
    board_send_all(&board, parcel("left"));
    board_remove_page(&board, page);
}

TEST(replies_go_to_the_page_that_asked)
{
    BoardPage *a = board_add_page(&board), *b = board_add_page(&board);
    assert_int_not_equal(a->sender, b->sender);
    assert_true(board_send(&board, b->sender, parcel("for b")));
    assert_true(board_send(&board, a->sender, parcel("for a")));
    assert_false(board_send(&board, 0, parcel("for nobody")));
    assert_string_equal(take(a), "for a ");
    assert_string_equal(take(b), "for b ");
    board_remove_page(&board, a);
    board_remove_page(&board, b);
}

TEST(there_are_no_more_pages_than_places)
{
    BoardPage *page[BOARD_PAGES];
    for (int k = 0; k < BOARD_PAGES; k++) {
        page[k] = board_add_page(&board);
        assert_non_null(page[k]);
    }
    assert_null(board_add_page(&board));
    assert_int_equal(board_pages(&board), BOARD_PAGES);
    board_remove_page(&board, page[3]);
    page[3] = board_add_page(&board);
    assert_non_null(page[3]);
    for (int k = 0; k < BOARD_PAGES; k++)
        board_remove_page(&board, page[k]);
}

// Whoever answers pings but never draws keeps its place only until another page wants it.
TEST(the_page_that_has_not_drawn_for_longest_is_ended_for_another)
{
    BoardPage *page[3];
    board_set(&board, BOARD_STATUS, parcel("status"));
    for (int k = 0; k < 3; k++) {
        page[k] = board_add_page(&board);
        take(page[k]);
    }
    board_drawn(&board, page[0], round_.number);
    page[2]->taken_ns = page[1]->taken_ns - 1; // before the other
    const int64_t now_ns = page[2]->taken_ns + BOARD_IDLE_NS;
    assert_false(board_stop_idle(&board, now_ns));
    assert_true(board_stop_idle(&board, now_ns + 1));
    assert_true(board_stopped(&board, page[2]));
    assert_false(board_stopped(&board, page[1]));
    assert_true(board_stop_idle(&board, page[1]->taken_ns + BOARD_IDLE_NS + 1));
    assert_false(board_stop_idle(&board, INT64_MAX)); // the first one draws
    assert_false(board_stopped(&board, page[0]));
    for (int k = 0; k < 3; k++)
        board_remove_page(&board, page[k]);
}

TEST(contacts_of_more_tools_than_places_are_left_out)
{
    BoardPage *page = board_add_page(&board);
    for (int tool = 0; tool < 2 * BOARD_TOOLS; tool++) {
        board_set_contact(&board, &(pliant_contact_t){.tool = tool});
        board_set_pose(&board, &(pliant_tool_pose_t){.tool = tool});
    }
    assert_true(board_next_round(&board, page, 0, &round_));
    assert_int_equal(round_.contacts, BOARD_TOOLS);
    assert_int_equal(round_.poses, BOARD_TOOLS);
    board_remove_page(&board, page);
}
