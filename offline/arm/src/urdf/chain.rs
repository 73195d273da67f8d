//! From links and joints to one serial chain: the tree, the path, fixed joints merged.

use std::collections::{HashMap, HashSet};

use nalgebra::IsometryMatrix3;

use super::document::{Joint, Motion, Robot};
use super::transmission::Transmission;
use super::{Drive, Options, UrdfArm, UrdfError};
use crate::serial::{self, Body, LinkInertia, SerialArm, Tool};

/// Links by index, each with the joint above and the joints below it.
struct Tree<'a> {
    robot: &'a Robot,
    parent: Vec<Option<usize>>,
    children: Vec<Vec<usize>>,
    /// Does any joint behind the link move?
    moves_behind: Vec<bool>,
    /// Link at a joint's lower end.
    child_link: Vec<usize>,
    /// Link at a joint's upper end.
    parent_link: Vec<usize>,
    root: usize,
}

/// What a serial arm is made of, and the joints that move it.
struct Chain {
    bodies: Vec<Body>,
    moving: Vec<usize>,
    tools: Vec<Tool>,
}

pub(super) fn arm(robot: &Robot, options: &Options) -> Result<UrdfArm, UrdfError> {
    let tree = Tree::new(robot)?;
    let path = match &options.tip {
        Some(tip) => tree.path_to(tip)?,
        None => tree.only_path()?,
    };
    let Some(first) = path.iter().position(|&joint| robot.joints[joint].motion != Motion::Fixed) else {
        return Err(nothing_moves(&tree, options));
    };
    let base_in_root: IsometryMatrix3<f64> =
        path[..first].iter().fold(IsometryMatrix3::identity(), |pose, &joint| pose * robot.joints[joint].origin);
    let mut notes = Vec::new();
    let Chain { bodies, moving, tools } = tree.merge(&path[first..], options, &mut notes);
    let gravity = base_in_root.rotation.inverse() * options.gravity_in_root_m_s2;
    let base = &robot.links[tree.parent_link[path[first]]].name;
    let arm = SerialArm::new(&robot.name, bodies, gravity, tools)?.with_base_name(base);
    note_impossible(&arm, &mut notes);
    let drives = drives(robot, &moving, &mut notes)?;
    Ok(UrdfArm { arm, drives, root: robot.links[tree.root].name.clone(), base_in_root, notes })
}

fn nothing_moves(tree: &Tree, options: &Options) -> UrdfError {
    let tip = options.tip.as_ref().map_or_else(|| "any other link".to_owned(), |tip| format!("`{tip}`"));
    UrdfError::NothingMoves { root: tree.robot.links[tree.root].name.clone(), tip }
}

impl<'a> Tree<'a> {
    fn new(robot: &'a Robot) -> Result<Self, UrdfError> {
        let count = robot.links.len();
        let index: HashMap<&str, usize> = robot.links.iter().enumerate().map(|(i, link)| (link.name.as_str(), i)).collect();
        let (mut parent, mut children) = (vec![None; count], vec![Vec::new(); count]);
        let (mut child_link, mut parent_link) = (Vec::new(), Vec::new());
        for (number, joint) in robot.joints.iter().enumerate() {
            let find = |link: &String| {
                let unknown = || UrdfError::UnknownLink { line: joint.line, joint: joint.name.clone(), link: link.clone() };
                index.get(link.as_str()).copied().ok_or_else(unknown)
            };
            let (above, below) = (find(&joint.parent)?, find(&joint.child)?);
            if let Some(other) = parent[below] {
                let other: &Joint = &robot.joints[other];
                let (joint, link, line) = (joint.name.clone(), joint.child.clone(), joint.line);
                return Err(UrdfError::TwoParents { line, joint, link, other: other.name.clone() });
            }
            parent[below] = Some(number);
            children[above].push(number);
            child_link.push(below);
            parent_link.push(above);
        }
        let roots: Vec<usize> = (0..count).filter(|&link| parent[link].is_none()).collect();
        let root = match roots[..] {
            [root] => root,
            [] if count == 0 => return Err(UrdfError::Roots { found: "no link at all".to_owned() }),
            [] => return Err(UrdfError::Roots { found: "every link is some joint's child, the joints form a loop".to_owned() }),
            _ => return Err(UrdfError::Roots { found: format!("several roots, {}", names(robot, &roots)) }),
        };
        let mut order = vec![root];
        let mut next = 0;
        while let Some(&link) = order.get(next) {
            order.extend(children[link].iter().map(|&joint: &usize| child_link[joint]));
            next += 1;
        }
        // One root and one parent each: what is not reached from the root is a loop of its own.
        if order.len() < count {
            return Err(UrdfError::Roots { found: "some joints form a loop apart from the root".to_owned() });
        }
        let mut moves_behind = vec![false; count];
        for &link in order.iter().rev() {
            let moves = |&joint: &usize| robot.joints[joint].motion != Motion::Fixed || moves_behind[child_link[joint]];
            moves_behind[link] = children[link].iter().any(moves);
        }
        Ok(Self { robot, parent, children, moves_behind, child_link, parent_link, root })
    }

    fn moves(&self, joint: usize) -> bool {
        self.robot.joints[joint].motion != Motion::Fixed
    }

    /// Joints from the root to a link.
    fn path_to(&self, tip: &str) -> Result<Vec<usize>, UrdfError> {
        let Some(mut link) = self.robot.links.iter().position(|link| link.name == tip) else {
            let all: Vec<usize> = (0..self.robot.links.len()).collect();
            return Err(UrdfError::UnknownTip { tip: tip.to_owned(), known: names(self.robot, &all) });
        };
        let mut path = Vec::new();
        while let Some(joint) = self.parent[link] {
            path.push(joint);
            link = self.parent_link[joint];
        }
        path.reverse();
        self.refuse_others(&path)?;
        Ok(path)
    }

    /// Joints from the root to the end of the only branch that moves, up to the last moving joint.
    fn only_path(&self) -> Result<Vec<usize>, UrdfError> {
        let all: Vec<usize> = (0..self.robot.joints.len()).collect();
        self.refuse_others(&all)?;
        let (mut path, mut link) = (Vec::new(), self.root);
        loop {
            let with_motion: Vec<usize> = self.children[link]
                .iter()
                .copied()
                .filter(|&joint| self.moves(joint) || self.moves_behind[self.child_link[joint]])
                .collect();
            match with_motion[..] {
                [] => return Ok(path),
                [joint] => {
                    path.push(joint);
                    link = self.child_link[joint];
                }
                _ => return Err(self.branch(link, &with_motion)),
            }
        }
    }

    fn branch(&self, link: usize, joints: &[usize]) -> UrdfError {
        let joints: Vec<&str> = joints.iter().map(|&joint| self.robot.joints[joint].name.as_str()).collect();
        let tips: Vec<usize> = (0..self.robot.links.len()).filter(|&link| self.children[link].is_empty()).collect();
        UrdfError::Branch { link: self.robot.links[link].name.clone(), joints: joints.join(", "), tips: names(self.robot, &tips) }
    }

    fn refuse_others(&self, joints: &[usize]) -> Result<(), UrdfError> {
        for joint in joints.iter().map(|&joint| &self.robot.joints[joint]) {
            if let Motion::Other(kind) = &joint.motion {
                return Err(UrdfError::JointKind { line: joint.line, joint: joint.name.clone(), kind: kind.clone() });
            }
        }
        Ok(())
    }

    /// Bodies, the joints that move them, and the frames on the last one. `path` starts with a moving joint.
    fn merge(&self, path: &[usize], options: &Options, notes: &mut Vec<String>) -> Chain {
        let (mut bodies, mut moving): (Vec<Body>, Vec<usize>) = (Vec::new(), Vec::new());
        // Pose of the current joint's parent link in the frame of the last body.
        let mut pose = IsometryMatrix3::identity();
        for &number in path {
            let joint = &self.robot.joints[number];
            pose *= joint.origin;
            let Motion::Moving(kind) = joint.motion else { continue };
            notes.extend(joint.notes.iter().cloned());
            bodies.push(Body {
                name: joint.child.clone(),
                joint: serial::Joint { name: joint.name.clone(), kind, axis: joint.axis, limits: joint.limits },
                placement: std::mem::replace(&mut pose, IsometryMatrix3::identity()),
                inertia: LinkInertia::ZERO,
            });
            moving.push(number);
        }
        let mut tools = Vec::new();
        let in_chain: HashSet<usize> = moving.iter().copied().collect();
        for (body, &joint) in moving.iter().enumerate() {
            let rigid = self.rigid(self.child_link[joint], &in_chain, notes);
            bodies[body].inertia = self.lumped(&rigid, notes);
            if body + 1 == moving.len() {
                tools = self.tools(&rigid, options, notes);
            }
        }
        Chain { bodies, moving, tools }
    }

    /// Links that move with a link, each with its pose in it; joints beside the chain stand at 0.
    fn rigid(&self, link: usize, moving: &HashSet<usize>, notes: &mut Vec<String>) -> Vec<(usize, IsometryMatrix3<f64>)> {
        let mut found = vec![(link, IsometryMatrix3::identity())];
        let mut next = 0;
        while let Some(&(link, pose)) = found.get(next) {
            for &joint in self.children[link].iter().filter(|joint| !moving.contains(joint)) {
                if self.moves(joint) {
                    notes.push(format!("joint {}: beside the chain, held at 0", self.robot.joints[joint].name));
                }
                found.push((self.child_link[joint], pose * self.robot.joints[joint].origin));
            }
            next += 1;
        }
        found
    }

    fn lumped(&self, rigid: &[(usize, IsometryMatrix3<f64>)], notes: &mut Vec<String>) -> LinkInertia {
        let parts: Vec<LinkInertia> = rigid
            .iter()
            .filter_map(|(link, pose)| self.robot.links[*link].inertia.map(|inertia| inertia.transformed(pose)))
            .collect();
        if parts.is_empty() {
            notes.push(format!("link {}: no <inertial>, taken as massless", self.robot.links[rigid[0].0].name));
        }
        // One part stays as it is written.
        parts.into_iter().reduce(|sum, part| sum.plus(&part)).unwrap_or(LinkInertia::ZERO)
    }

    /// Frames fixed to the last link: the tip first.
    fn tools(&self, rigid: &[(usize, IsometryMatrix3<f64>)], options: &Options, notes: &mut Vec<String>) -> Vec<Tool> {
        let name = |link: usize| &self.robot.links[link].name;
        let leaves: Vec<usize> = rigid.iter().map(|part| part.0).filter(|&link| self.children[link].is_empty()).collect();
        let tip = match &options.tip {
            Some(tip) => rigid.iter().map(|part| part.0).find(|&link| name(link) == tip),
            None => leaves.first().copied(),
        };
        if options.tip.is_none() && leaves.len() > 1 {
            notes.push(format!("tip: `{}`, the first of the links {}", name(leaves[0]), names(self.robot, &leaves)));
        }
        let mut tools: Vec<Tool> = rigid.iter().map(|&(link, pose)| Tool { name: name(link).clone(), pose }).collect();
        if let Some(at) = tip.and_then(|tip| rigid.iter().position(|part| part.0 == tip)) {
            tools[..=at].rotate_right(1);
        }
        tools
    }
}

fn note_impossible(arm: &SerialArm, notes: &mut Vec<String>) {
    for body in arm.bodies().iter().filter(|body| body.inertia != LinkInertia::ZERO) {
        if !body.inertia.is_physically_consistent() {
            notes.push(format!("link {}: no body with mass spread in space has this inertia; used as it is", body.name));
        }
    }
}

/// One drive per moving joint.
fn drives(robot: &Robot, moving: &[usize], notes: &mut Vec<String>) -> Result<Vec<Drive>, UrdfError> {
    let mut of_joint: Vec<Option<&Transmission>> = vec![None; robot.joints.len()];
    for transmission in &robot.transmissions {
        let refuse = |what: String| UrdfError::Transmission { line: transmission.line, name: transmission.name.clone(), what };
        let Some(joint) = robot.joints.iter().position(|joint| joint.name == transmission.joint) else {
            return Err(refuse(format!("there is no joint `{}`", transmission.joint)));
        };
        if let Some(other) = of_joint[joint].replace(transmission) {
            return Err(refuse(format!("joint `{}` already has transmission `{}`", transmission.joint, other.name)));
        }
        if !moving.contains(&joint) {
            notes.push(format!("transmission {}: joint {} is not in the chain, ignored", transmission.name, transmission.joint));
        }
    }
    Ok(moving.iter().map(|&joint| drive(&robot.joints[joint], of_joint[joint], notes)).collect())
}

fn drive(joint: &Joint, transmission: Option<&Transmission>, notes: &mut Vec<String>) -> Drive {
    let (damping, friction) = (joint.damping, joint.friction);
    let Some(transmission) = transmission else {
        notes.push(format!("joint {}: no <transmission>, reduction 1", joint.name));
        return Drive { transmission: None, actuator: None, reduction: 1.0, offset: 0.0, damping, friction };
    };
    if transmission.reduction.is_none() {
        notes.push(format!("transmission {}: no mechanicalReduction, 1", transmission.name));
    }
    Drive {
        transmission: Some(transmission.name.clone()),
        actuator: transmission.actuator.clone(),
        reduction: transmission.reduction.unwrap_or(1.0),
        offset: transmission.offset,
        damping,
        friction,
    }
}

fn names(robot: &Robot, links: &[usize]) -> String {
    links.iter().map(|&link| robot.links[link].name.as_str()).collect::<Vec<_>>().join(", ")
}
