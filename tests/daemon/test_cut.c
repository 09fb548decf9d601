// SPDX-License-Identifier: MIT
// Cuts through the real daemon: messages, answers and events, the client that sends them, blades,
// and whatever else may arrive. Bodies: a solid box and a hollow sphere that can be cut, a sphere
// that cannot.
#include "test.h"
#include "lcm_client.h"

static const char SCENE[] =
    "name = \"cuts\"; publish = { status_hz = 20.0; nodes_hz = 20.0; };\n"
    "bodies = (\n"
    "  { name = \"box\"; model = \"voxel\"; levels = 1; cuttable = true;\n"
    "    voxels = { generator = \"box\"; count = [8, 8, 8]; size = 0.005; };\n"
    "    fixed = ( { box = ([-1.0, -1.0, -1.0], [1.0, 1.0, -0.0199]); } ); },\n"
    "  { name = \"ball\"; model = \"surface\"; levels = 1; cuttable = true; shape = {};\n"
    "    mesh = { generator = \"ico_sphere\"; nodes = 642; radius = 0.03;\n"
    "             place = { translation = [0.2, 0.0, 0.0]; }; }; },\n"
    "  { name = \"hard\"; model = \"surface\"; shape = {};\n"
    "    mesh = { generator = \"ico_sphere\"; nodes = 42; radius = 0.03;\n"
    "             place = { translation = [0.4, 0.0, 0.0]; }; }; } );\n"
    "tools = ( { id = 1; kind = \"probe\"; max_force = 5.0;\n"
    "            capsules = ( { from = [0.0, 0.0, 0.0]; radius = 0.005; } ); },\n"
    "          { id = 2; kind = \"blade\"; edge = ([0.0, 0.0, 0.0], [0.0, 0.0, 0.06]); } );\n";

static int start_daemon(void **state)
{
    const char *path = scratch("cut.cfg");
    write_text(path, SCENE);
    return fixture_start(state, "%s", path);
}

static pliant_cut_t sweep_at(Client *client, double x, const char *body)
{
    return make_cut(client, x, 0.05, body);
}

static const Reply *send_cut(Client *client, const pliant_cut_t *cut)
{
    // Sent again each second until it is answered: datagrams get lost on a busy machine.
    const int before = count_replies(client, cut->id);
    for (int second = 0; second < 60 && count_replies(client, cut->id) == before; second++) {
        pliant_cut_t_publish(client->lcm, "PLIANT_CUT", cut);
        const double next = client_now() + 1.0;
        while (count_replies(client, cut->id) == before && client_now() < next)
            client_listen(client, 20);
    }
    assert_true(count_replies(client, cut->id) > before);
    return find_reply(client, cut->id);
}

static const Reply *cut_at(Client *client, double x, const char *body)
{
    const pliant_cut_t cut = sweep_at(client, x, body);
    return send_cut(client, &cut);
}

// Bodies in one piece again.
static void reset(Client *client)
{
    assert_true(command(client, PLIANT_COMMAND_T_RESET, 0, "")->ok);
}

// --- messages ---

AROUND_ALL(start_daemon, fixture_end)

TEST(a_cut_is_answered_with_what_it_severed)
{
    Client *client = ((Fixture *)*test_state)->client;
    reset(client);
    static const struct {
        const char *body;
        double x;
        int least;
        bool costs; // a wall's finest faces need shorter steps, cells are as large as before
    } cases[] = {{"box", 0.0001, 64, false}, {"ball", 0.2001, 20, true}};
    for (int k = 0; k < 2; k++) {
        const Reply *reply = cut_at(client, cases[k].x, cases[k].body);
        assert_string_equal(reply->channel, "PLIANT_CUT");
        print_message("%s\n", reply->text);
        assert_true(reply->ok);
        assert_true(reply->separated >= cases[k].least);
        assert_true(reply->nodes_added > 0);
        assert_int_equal(reply->pieces, 2);
        assert_true((strstr(reply->text, "times as long now") != NULL) == cases[k].costs);
        wait_until(client, saw_event(client, "cut") && saw_event(client, "piece"));
        client->events = 0;
        // Again: nothing is left to cut there.
        reply = cut_at(client, cases[k].x, cases[k].body);
        assert_false(reply->ok);
        assert_int_equal(reply->separated, 0);
        expect_in(reply->text, "cut already");
    }
}

TEST(a_repeated_cut_is_answered_again_and_not_made)
{
    Client *client = ((Fixture *)*test_state)->client;
    reset(client);
    char body[] = "box";
    pliant_cut_t cut = sweep_at(client, 0.0051, body);
    const Reply first = *send_cut(client, &cut);
    assert_true(first.ok);
    cut.before[0][0] += 0.005; // whatever else it says
    for (int k = 0; k < 3; k++) {
        const Reply *again = send_cut(client, &cut);
        assert_true(again->ok);
        assert_int_equal(again->step, first.step);
        assert_int_equal(again->separated, first.separated);
        assert_int_equal(again->nodes_added, first.nodes_added);
        assert_string_equal(again->text, first.text);
    }
}

TEST(all_bodies_are_cut_by_a_sweep_that_names_none)
{
    Client *client = ((Fixture *)*test_state)->client;
    reset(client);
    char all[] = "";
    pliant_cut_t cut = sweep_at(client, 0.0, all);
    // In the plane z = 0.0012, through all of them.
    const double before[2][3] = {{-0.1, -0.1, 0.0012}, {0.5, -0.1, 0.0012}};
    const double after[2][3] = {{-0.1, 0.1, 0.0012}, {0.5, 0.1, 0.0012}};
    memcpy(cut.before, before, sizeof before);
    memcpy(cut.after, after, sizeof after);
    const Reply *reply = send_cut(client, &cut);
    assert_true(reply->ok);
    expect_in(reply->text, "2 bodies: ");
    assert_int_equal(reply->pieces, 5); // and the one that cannot be cut
}

static void expect_refused(Client *client, pliant_cut_t *cut, const char *text)
{
    cut->id = ++client->next_id;
    const Reply *reply = send_cut(client, cut);
    assert_false(reply->ok);
    assert_int_equal(reply->separated, 0);
    assert_int_equal(reply->nodes_added, 0);
    expect_in(reply->text, text);
}

TEST(cuts_that_cannot_be_made_say_why)
{
    Client *client = ((Fixture *)*test_state)->client;
    reset(client);
    char box[] = "box", hard[] = "hard", nobody[] = "nobody", odd[] = "b\x01x", all[] = "";
    pliant_cut_t good = sweep_at(client, 0.0001, box), cut = good;
    memcpy(cut.before[1], cut.before[0], sizeof cut.before[0]);
    memcpy(cut.after[1], cut.after[0], sizeof cut.after[0]);
    expect_refused(client, &cut, "no length");
    cut = good;
    memcpy(cut.after, cut.before, sizeof cut.after);
    expect_refused(client, &cut, "does not move");
    cut = good;
    memset(cut.before, 0, sizeof cut.before);
    memset(cut.after, 0, sizeof cut.after);
    expect_refused(client, &cut, "no length");
    cut = sweep_at(client, 0.1, all); // between the bodies
    expect_refused(client, &cut, "met no tissue");
    cut = sweep_at(client, 900.0, box);
    expect_refused(client, &cut, "");
    cut = sweep_at(client, 1e4, box);
    expect_refused(client, &cut, "farther than 1000 m");
    cut = good;
    cut.after[1][2] = (double)NAN;
    expect_refused(client, &cut, "not finite");
    cut.after[1][2] = -(double)INFINITY;
    expect_refused(client, &cut, "not finite");
    cut = good;
    cut.body = hard;
    expect_refused(client, &cut, "body 'hard' is not cuttable");
    cut.body = nobody;
    expect_refused(client, &cut, "body 'nobody' is not in the scene");
    cut.body = odd;
    expect_refused(client, &cut, "body 'b?x' is not in the scene");
    // A propeller.
    cut = good;
    cut.after[0][0] = 500.0;
    cut.after[1][0] = -500.0;
    expect_refused(client, &cut, "too twisted");
    // Nothing was changed.
    client_fresh_status(client);
    const Reply *reply = cut_at(client, 0.0001, "box");
    assert_true(reply->ok);
    assert_int_equal(reply->pieces, 2);
}

TEST(an_inside_out_blade_cuts_like_any)
{
    Client *client = ((Fixture *)*test_state)->client;
    reset(client);
    char box[] = "box";
    pliant_cut_t cut = sweep_at(client, 0.0001, box), turned = cut;
    memcpy(turned.before[0], cut.after[1], sizeof turned.before[0]);
    memcpy(turned.before[1], cut.after[0], sizeof turned.before[0]);
    memcpy(turned.after[0], cut.before[1], sizeof turned.before[0]);
    memcpy(turned.after[1], cut.before[0], sizeof turned.before[0]);
    const Reply *reply = send_cut(client, &turned);
    assert_true(reply->ok);
    assert_int_equal(reply->pieces, 2);
}

TEST(random_cuts_do_no_harm)
{
    Client *client = ((Fixture *)*test_state)->client;
    reset(client);
    srand(5);
    int made = 0;
    for (int i = 0; i < 60; i++) {
        char all[] = "";
        pliant_cut_t cut = sweep_at(client, 0.0, all);
        for (int k = 0; k < 12; k++) {
            double size = i % 10 == 0 ? 500.0 : 0.1;
            double x = size * (2.0 * rand() / RAND_MAX - 1.0);
            (k < 6 ? &cut.before[0][0] : &cut.after[0][0])[k % 6] = x;
        }
        made += send_cut(client, &cut)->ok;
    }
    assert_true(made > 0);
    client_fresh_status(client);
    assert_int_equal(client->status.resets, 0);
    assert_true(isfinite(client->status.kinetic) && isfinite(client->status.max_displacement));
    reset(client);
}

// --- pliant-cut ---

static Process run;

static void run_cutter(const char *format, ...) __attribute__((format(printf, 1, 2)));
static void run_cutter(const char *format, ...)
{
    char arguments[2048];
    va_list list;
    va_start(list, format);
    vsnprintf(arguments, sizeof arguments, format, list);
    va_end(list);
    process_run(&run, program_path("pliant-cut"), "%s", arguments);
}

TEST(the_client_cuts_planes_polylines_and_files)
{
    Client *client = ((Fixture *)*test_state)->client;
    reset(client);
    run_cutter("--body box --plane 0.0001,0,0,1,0,0");
    assert_string_equal(run.err, "");
    expect_ended(&run, 0, "sweep 1: body 'box': ");
    expect_in(run.out, "1 sweep, 1 of them cut: ");
    expect_in(run.out, "2 pieces now");
    run_cutter("--body box --plane 0.0001,0,0,1,0,0");
    assert_int_equal(run.code, 1);
    expect_in(run.out, "refused: what the blade met of body 'box' was cut already");
    assert_string_equal(run.err, "pliant-cut: nothing was cut\n");
    // Two sweeps that bend.
    run_cutter("--blade 0,0,0.1 --point 0.15,0.001,-0.05 --point 0.2,0.01,-0.05 "
               "--point 0.25,0.001,-0.05");
    expect_ended(&run, 0, "2 sweeps, 2 of them cut: ");
    const char *file = scratch("path.txt");
    write_text(file, "# across, then another one\n"
                     "-0.05 0.0101 -0.05  -0.05 0.0101 0.05\n 0.05 0.0101 -0.05 0.05 0.0101 0.05\n"
                     "lift\n"
                     "-0.05 -0.0101 -0.05 -0.05 -0.0101 0.05\n0.05 -0.0101 -0.05 0.05 -0.0101 "
                     "0.05\n");
    run_cutter("--file %s", file);
    expect_ended(&run, 0, "2 sweeps, 2 of them cut: ");
}

TEST(an_unknown_body_is_answered_with_those_there_are)
{
    const char *says = "the daemon has no body 'bax', only: box, ball, hard\n";
    run_cutter("--body bax --plane 0.0001,0,0,1,0,0");
    expect_ended(&run, 1, says);
    process_run(&run, program_path("pliant-probe"), "--auto --body bax");
    expect_ended(&run, 1, says);
    // It ends by itself, long before the duration.
    process_run(&run, program_path("pliant-monitor"), "--nodes bax --write %s --duration 1e6",
                scratch("curve.tsv"));
    expect_ended(&run, 1, says);
}

// A ball of 5 mm, 2 mm before the nearest node, is in the body before it has moved.
TEST(a_tool_that_begins_in_the_body_begins_again_outside)
{
    process_run_well(&run, program_path("pliant-probe"),
                     "--auto --body box --clearance 0.002 --depth 0.003 --hold 0.1");
    // The server leads it out by 3 mm, less what it has come back since.
    const char *begins = "the tool begins in the body; starting ", *back = strstr(run.out, begins);
    assert_non_null(back);
    expect_at_least(strtod(back + strlen(begins), NULL), 4.5);
    // From 2 mm before its surface; a pose and its contact are 2 ms of 50 mm/s, or more, on the
    // way.
    const char *touched = strstr(run.out, "touched after ");
    assert_non_null(touched);
    expect_at_least(strtod(touched + strlen("touched after "), NULL), 1.5);
}

TEST(the_client_says_what_is_wrong_with_its_arguments)
{
    const char *file = scratch("bad.txt");
    write_text(file, "0 0 0 0 0 1\n0 1 0 0 1\n");
    static const Usage cases[] = {
        {"", 2, "nothing to cut"},
        {"--before 0,0,0,0,0,1", 2, "nothing to cut"},
        {"--after 0,0,0,0,0,1", 2, "--after '0,0,0,0,0,1' needs --before"},
        {"--before 0,0,0,0,0", 2, "--before '0,0,0,0,0' is not X,Y,Z,X,Y,Z, each in ["},
        {"--before 0,0,0,0,0,nan", 2, "is not X,Y,Z,X,Y,Z"},
        {"--point 0,0,0", 2, "--point '0,0,0' needs --blade"},
        {"--plane 0,0,0,0,0,0", 2, "its normal has no length"},
        {"--plane 0,0,0,0,0,1 --rate 0", 2, "--rate '0' is not a number in [0.01, 10000]"},
        {"--plane 0,0,0,0,0,1 --body a/b", 2, "--body 'a/b'"},
        {"--plane 0,0,0,0,0,1 --file x", 2, "either --file or positions"},
        {"--plane 0,0,0,0,0,1 what", 2, "'what' is not an option"},
        {"--file no-such-file", 2, "no-such-file: No such file"},
    };
    expect_usage(program_path("pliant-cut"), cases, sizeof cases / sizeof *cases);
    run_cutter("--file %s", file);
    expect_ended(&run, 2, "bad.txt:2: expected x y z x y z");
    run_cutter("--help");
    expect_ended(&run, 0, "--plane");
    // Nobody answers there.
    run_cutter("--prefix NOBODY --timeout 0.05 --tries 3 --plane 0,0,0,0,0,1");
    expect_ended(&run, 1, "no reply on NOBODY_CLAIM within 0.15 s");
    run_cutter("--stroke --prefix NOBODY --timeout 0.05 --tries 3 --plane 0,0,0,0,0,1");
    expect_ended(&run, 1, "NOBODY_STATUS within 0.15 s: no pliantd on");
}

TEST(the_client_moves_a_blade)
{
    Client *client = ((Fixture *)*test_state)->client;
    reset(client);
    client->events = 0;
    // On a machine that stalls for 0.2 s the tool falls silent amid the stroke and is
    // withdrawn: then nothing falls apart, and the stroke is made again.
    for (int tries = 0; tries < 3 && !saw_event(client, "piece"); tries++) {
        run_cutter("--stroke --tool 2 --speed 0.5 --blade 0,0,0.1 --point 0.0001,-0.04,-0.03 "
                   "--point 0.0001,0.04,-0.03");
        if (run.code != 0)
            print_error("%s", run.err);
        expect_ended(&run, 0, "cut: tool 2, stroke ended: body 'box': ");
        for (double limit = client_now() + 5.0;
             client_now() < limit && !saw_event(client, "piece");)
            client_listen(client, 20);
    }
    assert_true(saw_event(client, "piece"));
    // A tool that is no blade.
    run_cutter("--stroke --tool 1 --speed 1 --blade 0,0,0.1 --point 0,-0.4,0.3 "
               "--point 0,-0.3,0.3");
    expect_ended(&run, 1, "no stroke was reported on PLIANT_EVENT");
}

// --- blades ---

static void pose_blade(Client *client, double x, double y, bool active)
{
    const double position[3] = {x, y, -0.03};
    pliant_tool_pose_t pose = make_pose(client, position);
    pose.tool = 2;
    pose.active = active;
    send_pose(client, &pose);
}

TEST(a_blade_that_is_put_elsewhere_cuts_nothing_between)
{
    Client *client = ((Fixture *)*test_state)->client;
    reset(client);
    client->events = 0;
    // Down on the one side, up, down on the other at once: mostly within one tick.
    for (int i = 0; i < 100; i++) {
        for (int side = -1; side <= 1; side += 2) {
            pose_blade(client, 0.0001, 0.04 * side, true);
            client_listen(client, 3);
            pose_blade(client, 0.0001, 0.04 * side, false);
        }
    }
    pose_blade(client, 0.0001, 0.04, false);
    client_fresh_status(client);
    client_listen(client, 300);
    assert_false(saw_event(client, "cut"));
    // Along the same way without lifting it, it cuts.
    for (int i = 0; i <= 40; i++) {
        pose_blade(client, 0.0001, -0.04 + 0.002 * i, true);
        client_listen(client, 3);
    }
    pose_blade(client, 0.0001, 0.04, false);
    wait_until(client, saw_event(client, "cut"));
}

// --- repetition ---

AROUND_ALL(NULL, NULL)

TEST(a_log_of_inputs_repeats_cuts_and_strokes_bit_for_bit)
{
    const char *path = scratch("log.cfg"), *log = scratch("inputs.log");
    write_text(path, SCENE);
    char live[32], again[32];
    SCOPED_CLIENT Client *client = server_start(&pliantd, "--log-inputs %s %s", log, path);
    assert_true(cut_at(client, 0.0051, "box")->ok);
    cut_at(client, 0.1, "");
    for (int i = 0; i <= 60; i++) {
        pose_blade(client, -0.0049, -0.03 + 0.001 * i, i != 30);
        client_listen(client, 2);
    }
    assert_true(cut_at(client, 0.2003, "ball")->ok);
    process_end(&pliantd);
    printed_state(&pliantd, live);
    run_daemon_well(&pliantd, "--offline 1000 --input %s %s", log, path);
    printed_state(&pliantd, again);
    assert_string_equal(live, again);
}

#if WITH_HDF5
TEST(a_cut_scene_goes_on_from_checkpoints_bit_for_bit)
{
    const char *path = scratch("cp.cfg"), *cut = scratch("cut.h5"), *part = scratch("part.h5");
    write_text(path, SCENE);
    char saved[32], resumed[32], whole[32], parts[32];
    SCOPED_CLIENT Client *client = server_start(&pliantd, "--checkpoint %s %s", cut, path);
    assert_true(cut_at(client, 0.0051, "box")->ok);
    assert_true(cut_at(client, 0.2003, "ball")->ok);
    for (int i = 0; i < 30; i++) { // and in the middle of a stroke
        pose_blade(client, -0.0049, -0.03 + 0.001 * i, true);
        client_listen(client, 2);
    }
    process_end(&pliantd);
    printed_state(&pliantd, saved);
    run_daemon_well(&pliantd, "--offline 0 --resume %s %s", cut, path);
    printed_state(&pliantd, resumed);
    assert_string_equal(saved, resumed);
    run_daemon_well(&pliantd, "--offline 0.3 --resume %s %s", cut, path);
    printed_state(&pliantd, whole);
    run_daemon(&pliantd, "--offline 0.1 --resume %s --checkpoint %s %s", cut, part, path);
    run_daemon_well(&pliantd, "--offline 0.2 --resume %s %s", part, path);
    printed_state(&pliantd, parts);
    assert_string_equal(whole, parts);
    // A scene whose body cannot be cut is another one.
    char other[sizeof SCENE];
    memcpy(other, SCENE, sizeof other);
    memcpy(strstr(other, "cuttable = true"), "               ", 15);
    char *semicolon = strstr(other, "               ;");
    semicolon[15] = ' ';
    write_text(path, other);
    run_daemon(&pliantd, "--offline 0.1 --resume %s %s", cut, path);
    assert_int_equal(pliantd.code, 2);
}
#endif

// --- load ---

TEST(hundred_cuts_a_second_are_all_answered_while_a_tool_presses)
{
    enum { CUTS = 200 };
    const char *path = scratch("many.cfg"), *file = scratch("many.txt");
    write_text(path, SCENE);
    FILE *out = fopen(file, "w");
    assert_non_null(out);
    srand(9);
    for (int i = 0; i < CUTS; i++) {
        // The two ends go nearly the same way: few sweeps are too twisted.
        double end[12], way[3];
        for (int k = 0; k < 3; k++)
            way[k] = 0.08 * (2.0 * rand() / RAND_MAX - 1.0);
        for (int k = 0; k < 6; k++) {
            end[k] = 0.04 * (2.0 * rand() / RAND_MAX - 1.0) + (k % 3 == 0 && i % 2 ? 0.2 : 0.0);
            end[k + 6] = end[k] + way[k % 3] + 0.01 * (2.0 * rand() / RAND_MAX - 1.0);
        }
        fprintf(out, "lift\n%g %g %g %g %g %g\n%g %g %g %g %g %g\n", end[0], end[1], end[2], end[3],
                end[4], end[5], end[6], end[7], end[8], end[9], end[10], end[11]);
    }
    assert_int_equal(fclose(out), 0);
    Process daemon;
    SCOPED_CLIENT Client *client = server_start(&daemon, "%s", path);
    process_start(&run, program_path("pliant-cut"), "--quiet --rate 100 --file %s", file);
    const double press[3] = {0.0, 0.0, 0.023};
    double limit = client_now() + 60.0;
    while (client->replies < CUTS && client_now() < limit) {
        send_pose_at(client, press);
        client_listen(client, 2);
    }
    process_wait_for(&run, 0);
    char all[64];
    snprintf(all, sizeof all, "%d sweeps, ", CUTS);
    expect_in(run.out, all);
    client_fresh_status(client);
    assert_true(isfinite(client->status.kinetic) && isfinite(client->status.max_displacement));
    assert_int_equal(client->status.resets, 0);
    print_message("late ticks %lld of %lld; %s", (long long)client->status.late_ticks,
                  (long long)client->status.step, run.out);
    process_end(&daemon);
}

// Neither by messages, which are sent again until they are answered, nor by a blade on its way.
TEST(a_daemon_that_starts_is_not_cut_by_what_was_meant_for_the_last)
{
    static const char *const ways[] = {
        "--body ball --tries 1000 --rate 20 --repeat 100000 --plane 0.2001,0,0,1,0,0",
        "--stroke --tries 1000 --tool 2 --speed 0.02 --repeat 1000 --blade 0,0,0.06 "
        "--point 0.2001,-0.5,-0.03 --point 0.2001,0.5,-0.03"};
    const char *path = scratch("next.cfg");
    write_text(path, SCENE);
    for (int k = 0; k < 2; k++) {
        static Process daemon;
        SCOPED_CLIENT Client *client = server_start(&daemon, "%s", path);
        process_start(&run, program_path("pliant-cut"), "%s", ways[k]);
        if (k == 0)
            wait_until(client, client->replies > 2);
        else
            wait_until(client, client->contacts > 0 && client->contact.tool == 2 &&
                                   client->contact.pose_utime > 0);
        process_finish(&daemon, SIGKILL);
        client_destroy(client);
        client = server_start(&daemon, "%s", path);
        process_wait_for(&run, 1);
        expect_in(run.err, "the daemon that this was sent to is gone");
        client_fresh_status(client);
        assert_false(saw_event(client, "cut") || saw_event(client, "piece"));
        for (int i = 0; i < client->replies; i++)
            assert_string_not_equal(client->reply[i].channel, "PLIANT_CUT");
        process_end(&daemon);
    }
}
