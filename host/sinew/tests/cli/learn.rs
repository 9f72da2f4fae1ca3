//! Learned laws: files that other rigs take, and refusals.

use serde_json::Value;

use crate::desk::Desk;
use crate::schema::{schema, violations};

const RIG: &str = "format = \"sinew-rig/1\"\nname = \"block\" # on a pad\n[[body]]\n\
                   name = \"block\"\nmotion = \"slide\"\ninertia = 0.5\n[[spring]]\n\
                   name = \"pad\"\nfrom = \"ground\"\nto = \"block\"\n\
                   stiffness = { value = 300.0 }\n[[damper]]\nname = \"oil\"\nfrom = \"ground\"\n\
                   to = \"block\"\ndamping = { value = 0.8 }\n[[actuator]]\nname = \"push\"\n\
                   drives = \"block\"\ninput = \"u_N\"\ngain = 1.0\n[[sensor]]\nname = \"x\"\n\
                   reads = \"block.position\"\nsignal = \"q_m\"\n";

fn desk() -> Desk {
    let desk = Desk::new();
    desk.write("block.toml", RIG);
    for name in ["block.fit.csv", "block.check.csv"] {
        desk.bring(&format!("tests/foreign/pad/{name}"));
    }
    desk
}

const LINE: &str = "learn block.toml --at pad --fit block.fit.csv --check block.check.csv";

#[test]
fn a_law_is_written_and_another_rig_takes_it() {
    let desk = desk();
    let said = desk.succeed(&format!(
        "{LINE} --out pad.law.toml --rig-out learned.toml --json learn.json --report pad.html"
    ));
    assert!(said.contains("check q_m: free-run error"), "{said}");
    assert!(said.contains("next: `law = \"pad.law.toml\"`"), "{said}");
    let document: Value = serde_json::from_str(&desk.read("learn.json")).expect("JSON");
    assert_eq!(violations(&schema("learn"), &document), [""; 0]);
    let check = &document["signals"]["q_m"]["check"];
    let [straight, law] = ["straight_rms", "law_rms"].map(|key| check[key].as_f64());
    assert!(law.expect("an error") < 1e-4, "{check}");
    assert!(straight.expect("an error") > 1e-2, "{check}");
    assert!(desk.read("pad.html").contains("with the law"));
    let learned = desk.read("learned.toml");
    assert!(
        learned.contains("# on a pad") && learned.contains("law = \"pad\""),
        "{learned}"
    );

    // Another rig names the file, and its copy no longer needs it.
    desk.write(
        "other.toml",
        &RIG.replace(
            "stiffness = { value = 300.0 }",
            "law = \"pad.law.toml\"\nlaw_width = 2.0",
        ),
    );
    desk.succeed("simulate other.toml --input block.check.csv --out run.csv --quiet");
    desk.succeed("fit other.toml --fit block.fit.csv --out fitted.toml --quiet");
    assert!(
        desk.read("fitted.toml")
            .contains("[[law]]\nname = \"pad.law.toml\"")
    );
    let said = desk.sinew("mjcf other.toml --out other.xml");
    let said = String::from_utf8_lossy(&said.stderr).into_owned();
    assert!(
        said.contains("learned law of pad: a polynomial stands for it"),
        "{said}"
    );
}

#[test]
fn refusals_of_laws() {
    let desk = desk();
    desk.write(
        "broken.law.toml",
        "format = \"sinew-law/1\"\nname = \"x\"\nreach = 0.1\n",
    );
    desk.write(
        "broken.toml",
        &RIG.replace("stiffness = { value = 300.0 }", "law = \"broken.law.toml\""),
    );
    desk.write(
        "absent.toml",
        &RIG.replace(
            "stiffness = { value = 300.0 }",
            "law = \"broken.laws.toml\"",
        ),
    );
    let lines = [
        "learn block.toml --fit block.fit.csv --check block.check.csv",
        "learn block.toml --at pad --fit block.fit.csv",
        "learn block.toml --at pat --fit block.fit.csv --check block.check.csv --quiet",
        "learn block.toml --at pad --fit block.fit.csv --check block.fit.csv",
        &format!("{LINE} --out a.toml --out b.toml"),
        &format!("{LINE} --out block.toml"),
        &format!("{LINE} --at oil --any-slope --quiet"),
        "fit broken.toml --fit block.fit.csv",
        "fit absent.toml --fit block.fit.csv",
    ];
    let report: String = lines.iter().map(|line| desk.refusal(line)).collect();
    insta::assert_snapshot!(report);
}
